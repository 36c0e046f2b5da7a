"""What ``ratherthan tradeoffs`` was asked enters; plans as documents, lines and rows leave, and their policies as files."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ratherthan.apps.options import Wanted

if TYPE_CHECKING:
    from ratherthan.model.objective import Level, Objective, Threshold
    from ratherthan.model.problem import Problem
    from ratherthan.solve.pareto import Plan, Trade, Tradeoffs

__all__ = ["plan_csv", "plan_document", "plan_lines", "tradeoffs_of", "write_plans"]

WITHIN = "within"
"""How the plan within a bound is called among the others."""


def tradeoffs_of(wanted: Wanted, given: Mapping[str, Any]) -> Tradeoffs:
    """Return the trade-offs that the options ask for."""
    from ratherthan.apps.asked import problem_of
    from ratherthan.apps.waiting import waiting
    from ratherthan.model.states import start_of
    from ratherthan.solve.pareto import tradeoffs

    problem = problem_of(wanted)
    wishes = _wishes(wanted, problem, given["also"])
    start_of(problem.mdp)
    bound = _bound(wishes, given["at_most"], given["at_least"])
    with waiting("Solving") as tell:
        return tradeoffs(problem, wishes, bound=bound, most=given["most"], progress=tell)


def _wishes(wanted: Wanted, problem: Problem, also: tuple[str, ...]) -> list[Level]:
    """Return the objectives; where there is but one, also the least of each other reward until the same goal."""
    from ratherthan.errors import QuestionError
    from ratherthan.model.discounts import discount_taken
    from ratherthan.model.further import further_objective, least_of
    from ratherthan.model.objective import ReachAvoid, levels_of
    from ratherthan.model.property import wish_of

    wishes: list[Level] = []
    for text in wanted.properties or (None,):
        wishes += levels_of(_best(wish_of(problem, text, discount=wanted.discount)))
    for text in also:
        wishes += levels_of(_best(further_objective(problem, text, levels_of(wishes[0]), discount=wanted.discount)))
    discount_taken(wishes, wanted.discount)
    own = wishes[0]
    if len(wishes) == 1 and not isinstance(own, ReachAvoid):
        others = [least_of(name, level) for name in problem.mdp.rewards for level in levels_of(own)]
        wishes += [other for other in others if other is not None and not _excluded(other, own, problem)]
    if len(wishes) == 1:
        raise QuestionError(
            f"A trade-off must be between two or more objectives, got only '{wishes[0].text}'. Give others with --also."
        )
    return wishes


def _best(wish: Objective | Threshold) -> Objective:
    from ratherthan.errors import QuestionError
    from ratherthan.model.objective import Threshold

    if isinstance(wish, Threshold):
        raise QuestionError(f"A trade-off must be between best values (=?), got '{wish.text}'.", text=wish.text)
    return wish


def _excluded(other: Level, own: Objective, problem: Problem) -> bool:
    """Return whether a reward is the plan's own, or negative somewhere."""
    name = str(getattr(other, "reward", None))
    parts = problem.mdp.rewards[name].parts()
    return name == getattr(own, "reward", None) or any((values < 0).any() for _, values in parts)


def _bound(wishes: list[Level], at_most: str | None, at_least: str | None) -> dict[str, float] | None:
    """Return the bound that was given by NAME=NUMBER."""
    from ratherthan.errors import QuestionError
    from ratherthan.solve.weighing import called

    if at_most is None and at_least is None:
        return None
    if at_most is not None and at_least is not None:
        raise QuestionError("One objective can be bounded at a time: give --at-most or --at-least.")
    option, text = ("--at-most", at_most) if at_most is not None else ("--at-least", at_least)
    name, equals, number = str(text).rpartition("=")
    try:
        value = float(number) if equals else math.nan
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise QuestionError(f"{option} must be given as NAME=NUMBER, such as risk=0.2, got '{text}'.")
    for wish in wishes:
        if called(wish) == name.strip() and wish.maximise != (option == "--at-least"):
            other = "--at-least" if wish.maximise else "--at-most"
            raise QuestionError(
                f"'{wish.text}' asks for {'the most' if wish.maximise else 'the least'}: bound it with {other}, not {option}."
            )
    return {name.strip(): value}


def _shown(found: Tradeoffs) -> list[tuple[str, Plan]]:
    """Return all plans with how they are called."""
    plans = [(str(number), plan) for number, plan in enumerate(found.plans, 1)]
    if found.bounded is not None and found.bounded.plan is not None:
        plans.append((WITHIN, found.bounded.plan))
    return plans


def write_plans(found: Tradeoffs, folder: str) -> dict[str, str]:
    """Write every plan to a folder, and return their files."""
    from ratherthan.errors import SourceError
    from ratherthan.io.policy_write import write_policy

    try:
        Path(folder).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise SourceError(
            f"A folder must be writable, but '{folder}' is not: {error.strerror}.", path=folder
        ) from error
    files = {name: str(Path(folder) / f"plan-{name}.json") for name, _ in _shown(found)}
    for name, plan in _shown(found):
        write_policy(plan.policy, found.problem.mdp, files[name])
    return files


def plan_document(found: Tradeoffs, files: Mapping[str, str]) -> dict[str, Any]:
    """Return the trade-offs as a JSON document."""
    from ratherthan.narrate.tradeoffs import bound_lines, trade_lines
    from ratherthan.solve.weighing import called

    names, bounded = [called(objective) for objective in found.objectives], found.bounded
    return {
        "source": found.problem.source,
        "objectives": [
            {"name": name, "property": objective.text, "maximise": objective.maximise}
            for name, objective in zip(names, found.objectives, strict=True)
        ],
        "start": found.start,
        "start_name": found.problem.mdp.names[found.start],
        "text": [*trade_lines(found), *bound_lines(found)],
        "complete": found.complete,
        "plans": [_plan(str(number), plan, names, files) for number, plan in enumerate(found.plans, 1)],
        "trades": [
            {
                "objective": names[trade.objective],
                "from": str(trade.origin + 1),
                "to": str(trade.target + 1),
                "gain": trade.gain,
                "price": trade.price,
                "complete": trade.complete,
                "partings": [_parting(found, trade, state) for state in trade.partings],
            }
            for trade in found.trades
        ],
        "bounded": None if bounded is None else _bounded(found, names, files),
    }


def _parting(found: Tradeoffs, trade: Trade, state: int) -> dict[str, Any]:
    mdp = found.problem.mdp
    names = [mdp.action_name(int(found.plans[place].policy.choice[state])) for place in (trade.origin, trade.target)]
    return {"state": state, "state_name": mdp.names[state], "from": names[0], "to": names[1]}


def _plan(name: str, plan: Plan, names: list[str], files: Mapping[str, str]) -> dict[str, Any]:
    from ratherthan.explain.record import number

    return {
        "plan": name,
        "values": {
            key: {"value": number(value), "lower": number(lower), "upper": number(upper)}
            for key, value, lower, upper in zip(names, plan.values, plan.lower, plan.upper, strict=True)
        },
        "weights": {
            key: {"from": number(weights[0]), "to": number(weights[1])}
            for key, weights in zip(names, plan.weights, strict=True)
            if weights is not None
        },
        "policy": files.get(name),
    }


def _bounded(found: Tradeoffs, names: list[str], files: Mapping[str, str]) -> dict[str, Any]:
    from ratherthan.explain.record import number

    bounded = found.bounded
    assert bounded is not None
    mdp = found.problem.mdp
    coins = []
    for state in bounded.coins if bounded.plan is not None else ():
        chances = bounded.plan.policy.weights(mdp) if bounded.plan is not None else ()
        shares = {
            mdp.action_name(choice): float(chances[choice]) for choice in mdp.choices_of(state) if chances[choice]
        }
        coins.append({"state": state, "state_name": mdp.names[state], "chances": shares})
    return {
        "objective": names[bounded.objective],
        "limited": names[bounded.limited],
        "bound": bounded.bound,
        "best": number(bounded.best),
        "nearest": number(bounded.nearest),
        "plan": None if bounded.plan is None else _plan(WITHIN, bounded.plan, names, files),
        "coins": coins,
    }


def plan_lines(found: Tradeoffs) -> Iterator[str]:
    """Yield the table of plans, and a sentence for each step and for the bound."""
    from ratherthan.apps.door import one_line
    from ratherthan.narrate.tradeoffs import bound_lines, rounded, trade_lines, weight_head, weight_range
    from ratherthan.solve.weighing import called

    others = range(1, len(found.objectives))
    rows = [["plan", *map(called, found.objectives), *(weight_head(found, other) for other in others)]]
    for place, (name, plan) in enumerate(_shown(found)):
        known = place < len(found.plans)
        weights = [weight_range(found, place, other) if known else "" for other in others]
        rows.append([name, *(rounded(float(value)) for value in plan.values), *weights])
    if len(rows) > 1:
        widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
        for row in rows:
            yield one_line("  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True))).rstrip()
    for line in (*trade_lines(found), *bound_lines(found)):
        yield one_line(line)


def plan_csv(found: Tradeoffs) -> str:
    """Return the plans as comma-separated values, a row each."""
    from ratherthan.solve.weighing import called

    names = [called(objective) for objective in found.objectives]
    head = ["plan", *(f"{name}{end}" for name in names for end in ("", "_lower", "_upper"))]
    head += [f"weight_{name}_{end}" for name in names[1:] for end in ("from", "to")]
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(head)
    for name, plan in _shown(found):
        row: list[object] = [name]
        for values in zip(plan.values.tolist(), plan.lower.tolist(), plan.upper.tolist(), strict=True):
            row += values
        for weights in plan.weights[1:]:
            row += ["", ""] if weights is None else weights
        writer.writerow(row)
    return buffer.getvalue()
