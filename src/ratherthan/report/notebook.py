"""A model, Solution or Explanation enters, what a notebook shows of it leaves: HTML without scripts, its picture within it as an image.

The window asks IPython to come here by the names of the classes, so that nothing is loaded before something is shown (see
``ratherthan/__init__.py``). What cannot be drawn, as a solution without a map, is told in a table alone.
"""

from __future__ import annotations

import base64
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from html import escape
from importlib import resources
from typing import TYPE_CHECKING

from ratherthan.errors import RatherthanError

if TYPE_CHECKING:
    from ratherthan.explain.explanation import Explanation
    from ratherthan.model.mdp import MDP
    from ratherthan.model.problem import Problem
    from ratherthan.render import Picture
    from ratherthan.solve.solution import Solution

__all__ = ["shown"]

MOST_SENTENCES = 20
MOST_NAMES = 12
LARGE = 2_000_000
"""From how many states on a model is not drawn unasked."""

Table = Mapping[str, str]


def shown(thing: Explanation | Solution | Problem | MDP) -> str:
    """Return what a notebook shows.

    Parameters
    ----------
    thing : Explanation, Solution, Problem or MDP

    Examples
    --------
    >>> import ratherthan as rt
    >>> solution = rt.solve(rt.read("example:paper-5x5"))
    >>> "between 7.77777 and 7.77778" in shown(solution)
    True
    """
    from ratherthan.explain.explanation import Explanation
    from ratherthan.model.problem import Problem
    from ratherthan.solve.solution import Solution

    said = _words()
    if isinstance(thing, Explanation):
        return _explanation(thing, said)
    if isinstance(thing, Solution):
        return _picture(thing) + _table(_values(thing, said))
    problem = thing if isinstance(thing, Problem) else Problem(mdp=thing, source="")
    return _picture(problem) + _table(_model(problem, said))


def _words() -> Table:
    text = resources.files("ratherthan.report").joinpath("words", "en.toml").read_text(encoding="utf-8")
    found: Table = tomllib.loads(text)["notebook"]
    return found


def _explanation(explanation: Explanation, said: Table) -> str:
    """Return the sentences as a list, the first of many, and the picture."""
    from ratherthan.report.told import told_of

    told = told_of(explanation)
    rows = "".join(f"<li>{escape(text)}</li>" for _, text, _ in told.numbered[:MOST_SENTENCES])
    more = len(told.numbered) - MOST_SENTENCES
    listed = (
        f"<ol>{rows}</ol>" if len(told.numbered) > 1 else "".join(f"<p>{escape(t)}</p>" for _, t, _ in told.numbered)
    )
    closing = [said["more"].format(count=more)] if more > 0 else []
    paragraphs = "".join(f"<p>{escape(text)}</p>" for text in (*closing, *told.closing))
    return _picture(explanation) + listed + paragraphs


def _picture(thing: Explanation | Solution | Problem) -> str:
    """Return the picture of something as an image in HTML; nothing where it cannot be drawn or would take long."""
    from ratherthan.explain.explanation import Explanation
    from ratherthan.model.problem import Problem
    from ratherthan.render import draw

    if not isinstance(thing, Explanation):
        problem = thing if isinstance(thing, Problem) else thing.problem
        if problem.mdp.states > LARGE or (problem is not thing and problem.world is None):
            return ""
    try:
        return _image(draw(thing))
    except RatherthanError as error:
        return f"<p>{escape(error.message)}</p>"


def _image(picture: Picture) -> str:
    data = base64.b64encode(picture.svg.encode("utf-8")).decode("ascii")
    words = picture.parts.description if picture.parts is not None else ""
    return (
        f'<img alt="{escape(words)}" width="{picture.width:.0f}" style="max-width: 100%; height: auto" '
        f'src="data:image/svg+xml;base64,{data}">'
    )


def _table(rows: Iterator[tuple[str, str]]) -> str:
    listed = "".join(
        f'<tr><th scope="row" style="text-align: left">{escape(name)}</th>'
        f'<td style="text-align: left">{escape(text)}</td></tr>'
        for name, text in rows
        if text
    )
    return f"<table>{listed}</table>"


def _values(solution: Solution, said: Table) -> Iterator[tuple[str, str]]:
    """Yield the value at the start with its bounds, and how it was found."""
    from ratherthan.factors import Interval
    from ratherthan.report.numbers import bounds_in_words

    mdp = solution.problem.mdp
    yield said["source"], solution.problem.source
    values, lowers, uppers = (
        (solution.policy_values, solution.policy_lower, solution.policy_upper)
        if solution.given
        else (solution.values, solution.lower, solution.upper)
    )
    for level, objective in enumerate(solution.objectives):
        yield said["property"], objective.text
        for start in map(int, mdp.initial[:MOST_NAMES]):
            number = Interval(
                value=float(values[level, start]), lower=float(lowers[level, start]), upper=float(uppers[level, start])
            )
            proof = said["unproved"] if number.lower == -float("inf") and number.upper == float("inf") else ""
            proof = proof or (said["exact"] if number.infinite else bounds_in_words(number, said))
            yield said["value"].format(state=mdp.names[start]), f"{number.value:g} ({proof})"
    yield said["plan"], said["given" if solution.given else "best"]
    yield said["outcome"], solution.outcome.value
    yield from _sizes(mdp, said)


def _model(problem: Problem, said: Table) -> Iterator[tuple[str, str]]:
    """Yield what is in a model."""
    mdp = problem.mdp
    yield said["source"], problem.source
    yield from _sizes(mdp, said)
    yield said["starts"], _listed([mdp.names[int(state)] for state in mdp.initial[: MOST_NAMES + 1]], len(mdp.initial))
    yield said["actions"], _listed(mdp.actions, len(mdp.actions))
    yield said["rewards"], _listed(list(mdp.rewards), len(mdp.rewards))
    yield said["labels"], _listed(list(mdp.labels), len(mdp.labels))
    yield said["property"], "" if problem.objective is None else problem.objective.text


def _sizes(mdp: MDP, said: Table) -> Iterator[tuple[str, str]]:
    counts = {"states": mdp.states, "choices": mdp.choices, "branches": mdp.branches}
    yield said["size"], said["sizes"].format(**{name: f"{count:,}" for name, count in counts.items()})


def _listed(names: Sequence[str], count: int) -> str:
    """Return names in one line, the first of many."""
    return ", ".join(names[:MOST_NAMES]) + (", …" if count > MOST_NAMES else "")
