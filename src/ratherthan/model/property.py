"""The text of a PRISM property and a problem enter, an objective or a threshold leaves.

Read are the properties that can be explained: ``R{"r"}min=? [F g]`` (``max``; ``T`` counts steps) and ``Pmax=? [a U b]``,
``Pmax=? [F g]`` (``min``), each also with a bound instead of ``=?``. A bound must hold under every policy, so ``P>=p`` and
``P>p`` compare the minimum, ``P<=p`` and ``P<p`` the maximum; ``Pmax>=p`` says it outright. Everything else of PRISM's
property language is refused by its name, with the nearest property that can be explained.

The sets of states are kept as canonical text with the definitions of the source put in: an objective stands on its own over
the labels and state variables of its model. Labels, rewards, names and types are checked against the model at once.
"""

from __future__ import annotations

from collections.abc import Mapping

from ratherthan.errors import PropertyError
from ratherthan.model.formula import constant, resolved, states_of
from ratherthan.model.objective import ExpectedCost, Objective, ReachAvoid, Threshold
from ratherthan.model.problem import Problem
from ratherthan.model.syntax import Term, text_of
from ratherthan.model.temporal import Statement, check_path
from ratherthan.model.valuation import one_of

__all__ = ["choose_objective", "parse_property"]

_GOALS = ("goal", "target", "destination")
_MOST_LISTED = 12


def parse_property(text: str, problem: Problem) -> Objective | Threshold:
    """Read one property in PRISM's syntax.

    Parameters
    ----------
    text : str
        The property; a name (``"name":``), comments and semicolons at the end may stand around it.
    problem : Problem
        Its model, and the constants and formulas that the property may mention.

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
    from ratherthan.model.reading import read

    statement: Statement = read("property", text, "property")
    try:
        return _meaning(statement, problem, text)
    except RecursionError:
        raise PropertyError(f"The property '{text[:60]} …' is nested too deeply to be evaluated.", text=text) from None


def _meaning(said: Statement, problem: Problem, text: str) -> Objective | Threshold:
    """Return what a statement means for a problem."""
    reward = _reward(said.reward, problem, text) if said.operator == "R" else None
    if said.relation is None or said.bound is None:
        if not said.way and problem.mdp.choices > problem.mdp.states:
            raise PropertyError(
                f"A property of a model with decisions must say min or max: {said.operator}min=? or {said.operator}max=?, "
                f"got '{text.strip()}'.",
                text=text,
            )
        return _objective(said, reward, said.way == "max" or (not said.way and said.operator == "P"), problem)
    maximise = said.way == "max" if said.way else said.relation in ("<=", "<")
    objective = _objective(said, reward, maximise, problem)
    bound = constant(resolved(said.bound, problem.definitions))
    if not 0 <= bound < float("inf") or (said.operator == "P" and bound > 1):
        wanted = "lie between 0 and 1" if said.operator == "P" else "be finite and at least 0"
        raise PropertyError(f"The bound of a property must {wanted}, got {bound:g} in '{text.strip()}'.", text=text)
    return Threshold(objective=objective, relation=said.relation, bound=bound)


def _reward(name: str | None, problem: Problem, text: str) -> str:
    """Return the reward called `name`, the only one where it is None."""
    rewards = problem.mdp.rewards
    if name is None and len(rewards) == 1:
        return next(iter(rewards))
    if name is not None and name in rewards:
        return name
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


def _objective(said: Statement, reward: str | None, maximise: bool, problem: Problem) -> Objective:
    """Return the objective of a statement, refusing paths that cannot be explained."""
    path = said.path
    check_path(path, f'R{{"{reward}"}}' if said.operator == "R" else said.operator, maximise=maximise)
    parts = [resolved(part, problem.definitions, problem.mdp.names.variables) for part in path.args]
    for part in parts:
        states_of(problem.mdp, part)
    goal = text_of(parts[-1])
    if said.operator in "RT":
        return ExpectedCost(goal=goal, reward=reward, maximise=maximise)
    anywhere = path.op == "F" or parts[0] == Term("truth", value=True)
    return ReachAvoid(goal=goal, through=None if anywhere else text_of(parts[0]), maximise=maximise)


def choose_objective(problem: Problem, text: str | None = None) -> Objective | Threshold:
    """Return what is wanted of a problem.

    Parameters
    ----------
    problem : Problem
    text : str, optional
        A property in PRISM's syntax, or the name of one of the source's own. Without it: the source's own if it has exactly
        one; else, with exactly one reward and one label among goal, target and destination, the least expected reward until
        there.

    Returns
    -------
    Objective or Threshold

    Raises
    ------
    PropertyError
        If `text` cannot be read, or without it if there is no such property; it lists what there is.
    """
    if text is not None:
        name = text.strip().removeprefix('"').removesuffix('"')
        return problem.properties[name] if name in problem.properties else _parsed_or_named(text, problem)
    if problem.objective is not None:
        return problem.objective
    if len(problem.properties) == 1:
        return next(iter(problem.properties.values()))
    goals = [label for label in _GOALS if label in problem.mdp.labels]
    if len(problem.mdp.rewards) == 1 and len(goals) == 1:
        return ExpectedCost(goal=text_of(Term("label", value=goals[0])), reward=next(iter(problem.mdp.rewards)))
    raise PropertyError(_what_there_is(problem))


def _parsed_or_named(text: str, problem: Problem) -> Objective | Threshold:
    """Parse `text`; where it looks like a name rather than a property, list the names there are."""
    if problem.properties and not set(text) & set("[]=<>"):
        names = one_of(text.strip(), problem.properties)
        raise PropertyError(
            f"A property must be in PRISM's syntax or one of the source's own: {names}; got '{text.strip()}'.",
            text=text,
        )
    return parse_property(text, problem)


def _what_there_is(problem: Problem) -> str:
    """Say which properties, rewards and labels there are, with an example to copy."""
    mdp = problem.mdp
    goals = [label for label in _GOALS if label in mdp.labels] or list(mdp.labels) or ["init"]
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
