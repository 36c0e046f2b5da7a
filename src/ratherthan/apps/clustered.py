"""Options of a cluster enter; what a model in blocks answers leaves: its value, why at one state, and the route."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import click

from ratherthan.apps.options import Wanted, option

if TYPE_CHECKING:
    from ratherthan.cluster.archive import Described
    from ratherthan.cluster.asking import Told
    from ratherthan.cluster.blocks import Blocks, Blockwise

__all__ = ["cluster_options", "explain_in_blocks", "solve_in_blocks"]

LOCAL = "local"
ASKED = ("kind", "state", "rather_than", "alpha")
"""What explain may be asked in blocks."""
OURS = ("cluster", "workers", "blocks", "values_file")
Handler = Callable[..., int]


def cluster_options(handler: Handler, *, files: bool = False) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Decorate a command with the options of a cluster; where one is wanted, `handler` answers in place of the command.

    With `files` the values of all states can be written, too.
    """

    def decorate(command: Callable[..., Any]) -> Callable[..., Any]:
        @functools.wraps(command)
        def chosen(wanted: Wanted, **given: Any) -> Any:
            ours = {name: given.pop(name) for name in OURS if name in given}
            if ours["cluster"] is not None:
                address = None if ours["cluster"] == LOCAL else ours["cluster"]
                settings = {"cluster": address, "workers": ours["workers"] or 2, "blocks": ours["blocks"]}
                return handler(wanted, settings, ours.get("values_file"), given)
            set_without = next((name for name, value in ours.items() if value is not None), None)
            if set_without is not None:
                from ratherthan.errors import QuestionError

                shown = set_without.replace("values_file", "values-file")
                raise QuestionError(f"--{shown} must come with --cluster, which solves the model in blocks.")
            return command(wanted, **given)

        decorated: Callable[..., Any] = chosen
        for add in reversed(_OPTIONS if files else _OPTIONS[:-1]):
            decorated = add(decorated)
        return decorated

    return decorate


_OPTIONS = (
    option(
        "--cluster",
        section="Other",
        is_flag=False,
        flag_value=LOCAL,
        metavar="[ADDRESS]",
        help="Solve a UMB archive in blocks on the workers of a Dask scheduler, tcp://host:8786, or of this machine.",
    ),
    option(
        "--workers",
        section="Other",
        type=click.IntRange(min=1),
        metavar="N",
        help="So many local workers.  [default: 2]",
    ),
    option(
        "--blocks",
        section="Other",
        type=click.IntRange(min=1),
        metavar="N",
        help="So many blocks.  [default: one a worker]",
    ),
    option(
        "--values-file",
        section="Output",
        metavar="FILE.npz",
        help="With --cluster: write the values and bounds of all states, and the choice taken.",
    ),
)


def solve_in_blocks(wanted: Wanted, settings: Mapping[str, Any], values: str | None, given: dict[str, Any]) -> int:
    """Answer ``ratherthan solve --cluster``."""
    from ratherthan.apps.answers import value_lines
    from ratherthan.apps.output import as_json, form_of, send, send_lines

    form, output = given.pop("form"), given.pop("output")
    _refuse_others(wanted, given, ())

    def answer(solved: Blocks) -> Blockwise:
        found = solved.outcome(solved.start(wanted.start))
        if values is not None:
            from ratherthan.cluster.storing import store

            store(solved, values)
        return found

    def possible(about: Described) -> None:
        from ratherthan.cluster.blocks import start_in
        from ratherthan.cluster.storing import check_place

        start_in(about, wanted.start)
        if values is not None:
            check_place(values)

    found = _in_blocks(wanted, settings, possible, answer)
    document = value_of(found)
    if form_of(form, output, ("text", "json")) == "json":
        send([as_json(document)], output)
    else:
        send_lines(value_lines(document, found.property), output)
    return 0


def explain_in_blocks(wanted: Wanted, settings: Mapping[str, Any], _: str | None, given: dict[str, Any]) -> int:
    """Answer ``ratherthan explain --cluster``."""
    from ratherthan.apps.output import as_json, form_of, send, send_line

    form, output = given.pop("form"), given.pop("output")
    _refuse_others(wanted, given, ASKED)

    def answer(solved: Blocks) -> dict[str, Any]:
        from ratherthan.cluster.asking import ask, route_of

        start = solved.start(wanted.start if given["state"] is None else given["state"])
        head = {"source": wanted.source, "property": solved.objective.text}
        if given["kind"] == "naive-path":
            route, actions = route_of(solved, start)
            steps = [{"state": state, "action": action} for state, action in zip(route.states, actions, strict=False)]
            return head | {"kind": "naive-path", "outcome": route.outcome, "start": start, "steps": steps}
        told = ask(solved, start, given["kind"], rather_than=given["rather_than"], alpha=given["alpha"])
        return head | document_of(told)

    def possible(about: Described) -> None:
        from ratherthan.cluster.asking import check_question
        from ratherthan.cluster.blocks import start_in

        start_in(about, wanted.start if given["state"] is None else given["state"])
        if given["kind"] != "naive-path":
            check_question(about, given["kind"], given["rather_than"])

    document = _in_blocks(wanted, settings, possible, answer)
    if form_of(form, output, ("text", "json")) == "json":
        send([as_json(document)], output)
    elif "text" in document:
        send_line(document["text"], output)
    else:
        send([f"{step['state']}\t{step['action']}\n" for step in document["steps"]], output)
    return 0


def _refuse_others(wanted: Wanted, given: Mapping[str, Any], taken: tuple[str, ...]) -> None:
    """Raise QuestionError for options that mean nothing in blocks."""
    from ratherthan.errors import QuestionError

    plain = {"alpha": 0.0, "impact": "action-value", "values": "optimum"}
    others = [
        name for name, value in given.items() if name not in taken and value not in (plain.get(name), None, False, ())
    ]
    others += [
        *wanted.drive,
        *(name for name in ("discount", "constants", "lexicon") if getattr(wanted, name) is not None),
    ]
    if len(wanted.properties) > 1:
        others.append("property (twice)")
    if others:
        shown = others[0].replace("_", "-")
        raise QuestionError(f"--{shown} must be left out in blocks, or --cluster be left out: blocks cannot do both.")


def _in_blocks(
    wanted: Wanted, settings: Mapping[str, Any], possible: Callable[[Described], None], answer: Callable[[Blocks], Any]
) -> Any:
    """Solve a model in blocks and ask it what is `possible`."""
    from ratherthan.apps.waiting import waiting
    from ratherthan.cluster.blockwise import solved_in_blocks

    with (
        waiting("Solving in blocks") as tell,
        solved_in_blocks(
            wanted.source,
            wanted.properties[0] if wanted.properties else None,
            workers=settings["workers"],
            cluster=settings["cluster"],
            count=settings["blocks"],
            tell=tell,
            before=possible,
        ) as solved,
    ):
        return answer(solved)


def value_of(found: Blockwise) -> dict[str, Any]:
    """Return a value as the document of ``ratherthan solve``."""
    from ratherthan.explain.record import number
    from ratherthan.solve.solution import Outcome

    outcome = Outcome.CERTIFIED if found.certified else Outcome.UNCERTIFIED
    return {
        "value": number(found.value),
        "lower": number(found.lower) if found.lower > -float("inf") else None,
        "upper": number(found.upper) if found.upper < float("inf") or found.lower == found.upper else None,
        "states": found.states,
        "choices": found.choices,
        "branches": found.branches,
        "outcome": outcome.name.lower(),
        "message": outcome.value,
        "engine": f"windowed sweeps in {found.blocks} blocks, {found.rounds[0]} + {found.rounds[1]} rounds",
    }


def document_of(told: Told) -> dict[str, Any]:
    """Return what is said of a state as a document."""
    from ratherthan.explain.record import number

    rows = [
        {key: number(value) if isinstance(value, float) else value for key, value in choice.items()}
        for choice in told.choices
    ]
    return {"text": told.text, "state": told.state, "action": told.action, "choices": rows}
