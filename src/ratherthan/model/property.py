"""The text of a PRISM property and a problem enter, an objective or a threshold leaves.

Read are the properties that can be explained: ``R{"r"}min=? [F g]`` (``max``; ``T`` counts steps) and ``Pmax=? [a U b]``,
``Pmax=? [F g]`` (``min``), each also with a bound instead of ``=?``; ``R{"r"}max=? [Fsure g]``, over plans that are sure to
arrive; ``R{"r"}max=? [Cdiscount=0.95]``, a discounted sum; and several, the first before the second, as ``… then …``. A
reward may be a weighted sum: ``R{"distance + 10 * risk"}``. A bound must hold under every policy, so ``P>=p`` and
``P>p`` compare the minimum, ``P<=p`` and ``P<p`` the maximum; ``Pmax>=p`` says it outright. Everything else of PRISM's
property language is refused by its name, with the nearest property that can be explained.

The sets of states are kept as canonical text with the definitions of the source put in: an objective stands on its own over
the labels and state variables of its model. Labels, rewards, names and types are checked against the model at once.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from ratherthan.errors import NotExplainableError, PropertyError
from ratherthan.model.discounts import GOALS, discount_of, discount_taken, fitting
from ratherthan.model.formula import constant, resolved, states_of
from ratherthan.model.objective import (
    Discounted,
    ExpectedCost,
    ExpectedReward,
    Level,
    Lexicographic,
    Mission,
    Objective,
    ReachAvoid,
    Threshold,
)
from ratherthan.model.path import is_temporal, plain_until, positive, state_formulas
from ratherthan.model.problem import Problem
from ratherthan.model.syntax import Term, text_of
from ratherthan.model.temporal import Statement, chance_of, until_of
from ratherthan.model.valuation import one_of
from ratherthan.model.weights import canonical_reward

__all__ = ["choose_objective", "lexicographic", "parse_property", "wish_of"]

_MOST_LISTED = 12
_THEN = re.compile(r"(?:(?<=\])\s*|\s+)then\s+")


def parse_property(text: str, problem: Problem, *, discount: float | None = None) -> Objective | Threshold:
    """Read one property in PRISM's syntax.

    Parameters
    ----------
    text : str
        The property; a name (``"name":``), comments and semicolons at the end may stand around it. Several with "then"
        between them are lexicographic.
    problem : Problem
        Its model, and the constants and formulas that the property may mention.
    discount : float, optional
        For ``R{"r"}max=? [C]``; of several properties those without end take it.

    Returns
    -------
    Objective or Threshold
        With self-contained canonical state formulas.

    Raises
    ------
    PropertyError
        For a syntax error (with its column), unknown labels, rewards and names, numbers where truth values are needed, and
        properties that cannot be explained (with the nearest that can).
    """
    wish = _parsed(text, problem, discount)
    discount_taken([wish], discount)
    return wish


def _parsed(text: str, problem: Problem, discount: float | None) -> Objective | Threshold:
    """Read one property, or several with "then" between them; the discount is for those that need one."""
    from ratherthan.model.reading import read

    parts = _parts(text)
    if len(parts) > 1:
        return lexicographic([_parsed(part, problem, discount) for part in parts])
    try:
        statement: Statement = read("property", text, "property")
    except NotExplainableError as error:
        raise fitting(error, text, problem) from error
    try:
        return _meaning(statement, problem, text, discount)
    except RecursionError:
        raise PropertyError(f"The property '{text[:60]} …' is nested too deeply to be evaluated.", text=text) from None


def _parts(text: str) -> list[str]:
    """Return the properties with "then" between them; a "then" within brackets or quotation marks is none."""
    parts, begin = [], 0
    for then in _THEN.finditer(text):
        outside = re.sub(r'"[^"\n]*"', "", text[begin : then.start()])
        if '"' not in outside and outside.count("[") == outside.count("]"):
            parts.append(text[begin : then.start()])
            begin = then.end()
    return [*parts, text[begin:]]


def lexicographic(levels: Sequence[Objective | Threshold]) -> Lexicographic:
    """Return several objectives, the first before the second, as one.

    Raises
    ------
    PropertyError
        If one is a yes-or-no question or has levels itself, or one stands twice.
    """
    checked: list[Level] = []
    for level in levels:
        if isinstance(level, Threshold | Lexicographic):
            raise PropertyError(
                f"Each of several properties must ask for one best value (=?), got '{level.text}'.", text=level.text
            )
        if level in checked:
            raise PropertyError(f"Several properties must differ, got '{level.text}' twice.", text=level.text)
        checked.append(level)
    for level in checked[1:]:
        if isinstance(level, Mission):
            raise PropertyError(
                "Of several properties only the first may need memory (steps, or one thing after another), for the run ends "
                f"with it; got '{level.text}' after '{checked[0].text}'. Put it first.",
                text=level.text,
            )
    return Lexicographic(levels=tuple(checked))


def _meaning(said: Statement, problem: Problem, text: str, discount: float | None) -> Objective | Threshold:
    """Return what a statement means for a problem."""
    reward = _reward(said.reward, problem, text) if said.operator == "R" else None
    if said.relation is None or said.bound is None:
        if not said.way and problem.mdp.choices > problem.mdp.states:
            raise PropertyError(
                f"A property of a model with decisions must say min or max: {said.operator}min=? or {said.operator}max=?, "
                f"got '{text.strip()}'.",
                text=text,
            )
        maximise = said.way == "max" or (not said.way and said.operator == "P")
        return _objective(said, reward, problem, maximise=maximise, discount=discount)
    maximise = said.way == "max" if said.way else said.relation in ("<=", "<")
    objective = _objective(said, reward, problem, maximise=maximise, discount=discount)
    bound = constant(resolved(said.bound, problem.definitions))
    if isinstance(objective, Discounted | ExpectedReward) and -float("inf") < bound < float("inf"):
        return Threshold(objective=objective, relation=said.relation, bound=bound)
    if not 0 <= bound < float("inf") or (said.operator == "P" and bound > 1):
        wanted = "lie between 0 and 1" if said.operator == "P" else "be finite and at least 0"
        raise PropertyError(f"The bound of a property must {wanted}, got {bound:g} in '{text.strip()}'.", text=text)
    return Threshold(objective=objective, relation=said.relation, bound=bound)


def _reward(name: str | None, problem: Problem, text: str) -> str:
    """Return the reward called `name`, the only one where it is None."""
    rewards = problem.mdp.rewards
    if name is None and len(rewards) == 1:
        return next(iter(rewards))
    if name is not None and rewards:
        found = canonical_reward(name, rewards)
        if found is not None:
            return found
    listed = one_of(name or "", rewards)
    if not rewards:
        raise PropertyError(
            f"A property with R must name a reward of the model, but it has none: '{text.strip()}'. "
            f'To count steps: Tmin=? [F "goal"].',
            text=text,
        )
    if name is None:
        raise PropertyError(
            f'A property must name its reward where the model has several: R{{"NAME"}} with one of {listed}, '
            f"got '{text.strip()}'.",
            text=text,
        )
    raise PropertyError(f"A reward must be one of the model's: {listed}; got '{name}'.", reward=name, text=text)


def _objective(
    said: Statement, reward: str | None, problem: Problem, *, maximise: bool, discount: float | None
) -> Level:
    """Return the objective of a statement, refusing paths that cannot be explained."""
    path = said.path
    if path.op == "C":
        return Discounted(reward=reward, discount=discount_of(said, reward, problem, discount), maximise=maximise)
    if said.operator == "P":
        return _chance(path, problem, maximise=maximise)
    kind = ExpectedReward if path.value == "sure" else ExpectedCost
    until = until_of(path, f'R{{"{reward}"}}' if said.operator == "R" else said.operator, maximise=maximise)
    goal = resolved(until, problem.definitions, problem.mdp.names.variables)
    states_of(problem.mdp, goal)
    return kind(goal=text_of(goal), reward=reward, maximise=maximise)


def _chance(path: Term, problem: Problem, *, maximise: bool) -> ReachAvoid | Mission:
    """Return the objective of a chance: one that needs no memory where that will do."""
    if not is_temporal(path):
        states_of(problem.mdp, resolved(path, problem.definitions, problem.mdp.names.variables))
    said = chance_of(path, problem, maximise=maximise)
    for part in state_formulas(said):
        states_of(problem.mdp, part)
    plain = plain_until(positive(said))
    if plain is None:
        return Mission(formula=text_of(said), maximise=maximise)
    through, goal = plain
    return ReachAvoid(goal=text_of(goal), through=None if through is None else text_of(through), maximise=maximise)


def choose_objective(
    problem: Problem, text: str | None = None, *, discount: float | None = None
) -> Objective | Threshold:
    """Return what is wanted of a problem.

    Parameters
    ----------
    problem : Problem
    text : str, optional
        A property in PRISM's syntax, or the name of one of the source's own. Without it: the source's own if it has exactly
        one; else, with exactly one reward and one label among goal, target and destination, the least expected reward until
        there.
    discount : float, optional
        For ``R{"r"}max=? [C]``.

    Returns
    -------
    Objective or Threshold

    Raises
    ------
    PropertyError
        If `text` cannot be read, or without it if there is no such property; it lists what there is.
    """
    if text is None and discount is not None:
        raise PropertyError("A discount must come with a property, such as --property 'R{\"reward\"}max=? [C]'.")
    wish = wish_of(problem, text, discount=discount)
    discount_taken([wish], discount)
    return wish


def wish_of(problem: Problem, text: str | None = None, *, discount: float | None = None) -> Objective | Threshold:
    """Return what is wanted as `choose_objective` does; the discount is for what needs one, and may be needed by nothing.

    Parameters
    ----------
    problem : Problem
    text : str, optional
    discount : float, optional

    Raises
    ------
    PropertyError
        As `choose_objective`.
    """
    if text is not None:
        own = _own(text, problem)
        if own is not None:
            return own
        parts = _parts(text)
        if len(parts) > 1:
            return lexicographic([wish_of(problem, part, discount=discount) for part in parts])
        try:
            return _parsed_or_named(problem.others.get(_bare(text), text), problem, discount)
        except PropertyError as error:
            if not problem.lacks or isinstance(error, NotExplainableError):
                raise
            raise PropertyError(f"{error.message} {problem.lacks}", **error.place) from error
    if problem.objective is not None:
        return problem.objective
    if len(problem.properties) == 1:
        return next(iter(problem.properties.values()))
    goals = [label for label in GOALS if label in problem.mdp.labels]
    if len(problem.mdp.rewards) == 1 and len(goals) == 1:
        return ExpectedCost(goal=text_of(Term("label", value=goals[0])), reward=next(iter(problem.mdp.rewards)))
    raise PropertyError(_what_there_is(problem))


def _bare(text: str) -> str:
    """Return a name without the quotation marks that may stand around it."""
    return text.strip().removeprefix('"').removesuffix('"')


def _own(text: str, problem: Problem) -> Objective | Threshold | None:
    """Return the property of the source that has this name."""
    return problem.properties.get(_bare(text))


def _parsed_or_named(text: str, problem: Problem, discount: float | None) -> Objective | Threshold:
    """Parse `text`; where it looks like a name rather than a property, list the names there are."""
    if (problem.properties or problem.others) and not set(text) & set("[]=<>"):
        names = one_of(text.strip(), [*problem.properties, *problem.others])
        raise PropertyError(
            f"A property must be in PRISM's syntax or one of the source's own: {names}; got '{text.strip()}'.",
            text=text,
        )
    return _parsed(text, problem, discount)


def _what_there_is(problem: Problem) -> str:
    """Say which properties, rewards and labels there are, with an example to copy."""
    if problem.lacks:
        return problem.lacks
    mdp = problem.mdp
    goals = [label for label in GOALS if label in mdp.labels] or list(mdp.labels) or ["init"]
    head = f'R{{"{next(iter(mdp.rewards))}"}}min' if mdp.rewards else "Pmax"
    listed = [
        f"{what}: {', '.join(names[:_MOST_LISTED]) + (' …' if len(names) > _MOST_LISTED else '') if names else 'none'}"
        for what, names in _offers(problem).items()
    ]
    example = next(iter(problem.properties), f"'{head}=? [F \"{goals[0]}\"]'")
    return (
        f"It must be clear what is wanted, but no property was given and the source leaves it open. "
        f"{'; '.join(listed)}. Give one, for example --property {example}."
    )


def _offers(problem: Problem) -> Mapping[str, list[str]]:
    return {
        "Properties": [f"{name} = {wanted.text}" for name, wanted in problem.properties.items()],
        "rewards": list(problem.mdp.rewards),
        "labels": list(problem.mdp.labels),
        "variables": list(problem.mdp.names.variables),
    }
