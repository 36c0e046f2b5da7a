"""Solutions, verdicts and models enter; their JSON documents and their lines for people leave."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import click

from ratherthan.apps.door import one_line

if TYPE_CHECKING:
    from ratherthan.errors import LimitError
    from ratherthan.model.objective import Objective, Threshold
    from ratherthan.model.problem import Problem
    from ratherthan.model.world import World
    from ratherthan.solve import Solution
    from ratherthan.verify import Verdicts

__all__ = [
    "decided",
    "example_documents",
    "example_lines",
    "info_document",
    "info_lines",
    "value_document",
    "value_lines",
    "verdict_document",
    "verdict_lines",
]

MOST_LISTED = 20


def value_document(solution: Solution, wish: Objective | Threshold, limit: LimitError | None = None) -> dict[str, Any]:
    """Return the value at the start with its bounds; of a yes-or-no property, whether it holds.

    Where a limit stopped the solver there is no value but where the bounds meet, and it is said which limit.

    The bounds are those of the number, also where the value is true, false or null (undecided); null where not proved. Of
    several objectives in order they are those of the first; ``levels`` has all. ``horizon`` and ``upper_within_horizon`` tell what no
    plan of so many steps exceeds, where nothing is proved beyond that.
    """
    from ratherthan.model.objective import Threshold
    from ratherthan.model.states import start_of

    mdp, start = solution.problem.mdp, start_of(solution.problem.mdp)
    values, lowers, uppers = (
        (solution.policy_values, solution.policy_lower, solution.policy_upper)
        if solution.given
        else (solution.values, solution.lower, solution.upper)
    )
    levels = [
        {"property": level.text} | _bounded(float(values[k, start]), float(lowers[k, start]), float(uppers[k, start]))
        for k, level in enumerate(solution.objectives)
    ]
    if limit is not None:
        for level in levels:
            level["value"] = level["value"] if level["lower"] == level["upper"] else None
    first = {key: levels[0][key] for key in ("value", "lower", "upper")}
    if isinstance(wish, Threshold):
        first["value"] = decided(wish, float(lowers[0, start]), float(uppers[0, start]))
    document = {
        **first,
        "states": mdp.states,
        "choices": mdp.choices,
        "branches": mdp.branches,
        "outcome": solution.outcome.name.lower().replace("_", " "),
        "message": solution.outcome.value,
        "engine": solution.engine,
    }
    if solution.horizon is not None and solution.within is not None and not solution.given:
        document |= {"horizon": solution.horizon, "upper_within_horizon": float(solution.within[start])}
    if limit is not None:
        document |= {
            "message": f"{limit.place.get('reached', limit.message)} {solution.outcome.value}",
            "limit": limit.place["limit"],
        }
    return document | ({"levels": levels} if len(levels) > 1 else {})


def _bounded(value: float, lower: float, upper: float) -> dict[str, Any]:
    """Return a value with its bounds as a document has them, null where nothing is proved."""
    from ratherthan.explain.record import number

    return {
        "value": number(value),
        "lower": None if lower == -float("inf") < upper else number(lower),
        "upper": None if upper == float("inf") > lower else number(upper),
    }


def decided(wish: Threshold, lower: float, upper: float) -> bool | None:
    """Return whether a yes-or-no property holds of a number between two bounds; None where they do not decide."""
    bound = wish.bound
    surely, never = {
        ">=": (lower >= bound, upper < bound),
        ">": (lower > bound, upper <= bound),
        "<=": (upper <= bound, lower > bound),
        "<": (upper < bound, lower >= bound),
    }[wish.relation]
    return True if surely else False if never else None


def value_lines(document: Mapping[str, Any], text: str) -> Iterator[str]:
    """Yield a value for people."""
    value = document["value"]
    unknown = "not known" if "limit" in document else "undecided"
    spelled = {True: "true", False: "false", None: unknown}[value] if isinstance(value, bool | None) else value
    bounds = [document[key] if document[key] is not None else "not proved" for key in ("lower", "upper")]
    sizes = ", ".join(f"{document[key]} {key}" for key in ("states", "choices", "branches"))
    yield from _pairs(
        {
            "property": one_line(text),
            "value": str(spelled),
            "lower": str(bounds[0]),
            "upper": str(bounds[1]),
            **_horizon_text(document),
            **{f"level {k}": _level_text(level) for k, level in enumerate(document.get("levels", [])[1:], 2)},
            "model": sizes,
            "outcome": document["message"],
            "engine": document["engine"],
        }
    )


def _horizon_text(document: Mapping[str, Any]) -> dict[str, str]:
    """Return what holds of plans of a limited number of steps, where that is known."""
    if "horizon" not in document:
        return {}
    return {"horizon": f"at most {document['upper_within_horizon']} within {document['horizon']:,} steps"}


def _level_text(level: Mapping[str, Any]) -> str:
    """Return the value of a further level with its bounds and property."""
    lower, upper = ("not proved" if level[key] is None else level[key] for key in ("lower", "upper"))
    value = "not known" if level["value"] is None else level["value"]
    return f"{value} (between {lower} and {upper}): {one_line(level['property'])}"


def _pairs(table: Mapping[str, str]) -> Iterator[str]:
    width = max(map(len, table))
    for key, value in table.items():
        yield f"{click.style(key, bold=True)}{' ' * (width - len(key))}  {value}".rstrip()


def info_document(problem: Problem) -> dict[str, Any]:
    """Return what is in a model."""
    mdp, world = problem.mdp, problem.world
    return {
        "source": problem.source,
        "states": mdp.states,
        "choices": mdp.choices,
        "branches": mdp.branches,
        "initial_states": len(mdp.initial),
        "initial": [{"state": int(s), "state_name": mdp.names[int(s)]} for s in mdp.initial[:MOST_LISTED]],
        "variables": list(mdp.names.variables),
        "actions": list(mdp.actions),
        "labels": {name: int(mask.sum()) for name, mask in mdp.labels.items()},
        "rewards": {name: [part for part, _ in reward.parts()] for name, reward in mdp.rewards.items()},
        "properties": {name: wish.text for name, wish in problem.properties.items()},
        "objective": _own_objective(problem),
        "definitions": dict(problem.definitions),
        "lacks": problem.lacks,
        "world": None
        if world is None
        else {"title": world.title, "note": world.note, "width": world.width, "height": world.height} | _lies(world),
        "notes": list(problem.notes),
    }


def _own_objective(problem: Problem) -> str | None:
    """Return what is explained where no property is given; None where one must be."""
    from ratherthan.errors import PropertyError
    from ratherthan.model.property import choose_objective

    try:
        return choose_objective(problem).text
    except PropertyError:
        return None


def _lies(world: World) -> dict[str, Any]:
    """Return where a map lies in the world, in metres."""
    frame = world.frame
    if frame is None:
        return {}
    corners = [frame.at(a * world.width, b * world.height, world.height) for a in (0, 1) for b in (0, 1)]
    x, y = ([round(f(corner[i] for corner in corners), 9) for f in (min, max)] for i in (0, 1))
    return {"resolution": frame.resolution, "x": x, "y": y}


def info_lines(document: Mapping[str, Any]) -> Iterator[str]:
    """Yield what is in a model for people."""
    world, initial = document["world"], document["initial"]
    starts = [
        f"{entry['state']}" + (f" ({entry['state_name']})" if entry["state_name"] != str(entry["state"]) else "")
        for entry in initial
    ]
    rows = {
        "source": document["source"],
        "states": str(document["states"]),
        "choices": str(document["choices"]),
        "branches": str(document["branches"]),
        "start": _listed(starts, document["initial_states"]),
        "variables": _listed(document["variables"]),
        "actions": _listed(document["actions"]),
        "labels": _listed([f"{name} ({count})" for name, count in document["labels"].items()]),
        "rewards": _listed([f"{name} (by {', '.join(parts)})" for name, parts in document["rewards"].items()]),
        "definitions": _listed([f"{name} = {text}" for name, text in document["definitions"].items()]),
        "objective": document["objective"]
        or ("none of its own: give --goal" if document["lacks"] else "none of its own: give --property"),
    }
    if world is not None:
        title = ", ".join(part for part in (world["title"], world["note"]) if part)
        side = f" of {world['resolution']:g} m" if "resolution" in world else ""
        rows["map"] = f"{world['width']} × {world['height']} cells{side}" + (f": {title}" if title else "")
        if "x" in world:
            rows["in metres"] = "x from {:g} to {:g}, y from {:g} to {:g}".format(*world["x"], *world["y"])
    yield from _pairs({key: one_line(text) for key, text in rows.items()})
    for key, texts in (
        ("properties", [f"{name}: {text}" for name, text in document["properties"].items()]),
        ("notes", document["notes"]),
    ):
        if texts:
            yield click.style(key, bold=True)
            yield from (f"  {one_line(text)}" for text in texts)


def _listed(names: list[str], count: int | None = None) -> str:
    """Return names in one line, shortened; "none" where there are none."""
    count = len(names) if count is None else count
    shown = names[:MOST_LISTED]
    return ", ".join(shown) + (f", … ({count} in all)" if count > len(shown) else "") if names else "none"


def example_documents() -> list[dict[str, Any]]:
    """Return the bundled examples, each with its sizes and what it is called."""
    from ratherthan.io import read
    from ratherthan.io.examples import example_names

    documents = []
    for name in example_names():
        problem = read(f"example:{name}")
        world = problem.world
        titles = () if world is None else (world.title, world.note)
        wishes = ([problem.objective] if problem.objective is not None else []) + list(problem.properties.values())
        documents.append(
            {
                "source": problem.source,
                "states": problem.mdp.states,
                "title": ", ".join(title for title in titles if title),
                "properties": list(dict.fromkeys(wish.text for wish in wishes)),
            }
        )
    return documents


def example_lines(documents: list[dict[str, Any]]) -> Iterator[str]:
    """Yield a line for each example."""
    table = {}
    for entry in documents:
        title = entry["title"] or ", ".join(entry["properties"])
        table[entry["source"]] = f"{entry['states']:>4} states  {title}"
    yield from _pairs(table)


def verdict_document(verdicts: Verdicts) -> dict[str, Any]:
    """Return the verdicts of a stored explanation."""
    return {
        "holds": verdicts.holds,
        "fails": verdicts.fails,
        "summary": verdicts.summary(),
        "checks": [
            {
                "what": check.what,
                "where": check.where,
                "state": check.state,
                "verdict": check.verdict.name.lower(),
                "reason": check.reason or check.verdict.value,
            }
            for check in verdicts.checks
        ],
    }


def verdict_lines(verdicts: Verdicts) -> Iterator[str]:
    """Yield a line for each check, and what comes of them."""
    colours = {"holds": "green", "fails": "red", "undecided": "yellow"}
    for check in verdicts.checks:
        name = check.verdict.name.lower()
        place = f" at {check.where}" if check.where else ""
        reason = f": {check.reason or check.verdict.value}" if name != "holds" else ""
        yield f"{click.style(f'{name:<9}', fg=colours[name])}  {one_line(check.what + place + reason)}"
    yield verdicts.summary()
