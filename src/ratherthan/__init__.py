"""A model enters, an explanation of its plan leaves: why this action rather than that one.

>>> import ratherthan as rt
>>> problem = rt.read("example:paper-5x5")
>>> solution = rt.solve(problem)
>>> print(rt.narrate(rt.explain(solution, kind="constrictive", state=10)))
We move east at grid 10 because it leads to the most flexible future route.

This is the shop window: everything in it is loaded when it is first touched, so that ``import ratherthan`` costs nothing.
"""

from __future__ import annotations

import importlib
import sys
import types

TYPE_CHECKING = False  # type checkers take it for true; loading the module typing takes longer than all of this
if TYPE_CHECKING:
    from ratherthan.errors import ExplanationError as ExplanationError
    from ratherthan.errors import InputError as InputError
    from ratherthan.errors import LimitError as LimitError
    from ratherthan.errors import MissingExtraError as MissingExtraError
    from ratherthan.errors import ModelError as ModelError
    from ratherthan.errors import NotExplainableError as NotExplainableError
    from ratherthan.errors import PolicyError as PolicyError
    from ratherthan.errors import PropertyError as PropertyError
    from ratherthan.errors import QuestionError as QuestionError
    from ratherthan.errors import RatherthanError as RatherthanError
    from ratherthan.errors import SourceError as SourceError
    from ratherthan.errors import StoppedError as StoppedError
    from ratherthan.errors import UnsolvedError as UnsolvedError
    from ratherthan.explain import Explanation as Explanation
    from ratherthan.explain import Factors as Factors
    from ratherthan.explain import Question as Question
    from ratherthan.explain import explain as explain
    from ratherthan.io import read as read
    from ratherthan.io import write as write
    from ratherthan.io.policies import read_policy as read_policy
    from ratherthan.model.lexicon import Lexicon as Lexicon
    from ratherthan.model.mdp import MDP as MDP
    from ratherthan.model.mdp import Reward as Reward
    from ratherthan.model.names import StateNames as StateNames
    from ratherthan.model.objective import Discounted as Discounted
    from ratherthan.model.objective import ExpectedCost as ExpectedCost
    from ratherthan.model.objective import ExpectedReward as ExpectedReward
    from ratherthan.model.objective import Lexicographic as Lexicographic
    from ratherthan.model.objective import Mission as Mission
    from ratherthan.model.objective import ReachAvoid as ReachAvoid
    from ratherthan.model.objective import Threshold as Threshold
    from ratherthan.model.policy import Policy as Policy
    from ratherthan.model.problem import Problem as Problem
    from ratherthan.model.property import parse_property as parse_property
    from ratherthan.model.watch import Limits as Limits
    from ratherthan.model.watch import watching as watching
    from ratherthan.model.world import World as World
    from ratherthan.narrate import from_json as from_json
    from ratherthan.narrate import narrate as narrate
    from ratherthan.narrate import to_json as to_json
    from ratherthan.render import Picture as Picture
    from ratherthan.render import draw as draw
    from ratherthan.report import Report as Report
    from ratherthan.report import report as report
    from ratherthan.solve import Outcome as Outcome
    from ratherthan.solve import Solution as Solution
    from ratherthan.solve import evaluate as evaluate
    from ratherthan.solve import solve as solve
    from ratherthan.solve.pareto import Tradeoffs as Tradeoffs
    from ratherthan.solve.pareto import tradeoffs as tradeoffs
    from ratherthan.verify import Verdicts as Verdicts
    from ratherthan.verify import verify as verify

    __version__: str

__all__ = [  # noqa: RUF022 - sorted as `sorted` does, which a test holds
    "Discounted",
    "ExpectedCost",
    "ExpectedReward",
    "Explanation",
    "ExplanationError",
    "Factors",
    "InputError",
    "Lexicographic",
    "Lexicon",
    "LimitError",
    "Limits",
    "MDP",
    "MissingExtraError",
    "Mission",
    "ModelError",
    "NotExplainableError",
    "Outcome",
    "Picture",
    "Policy",
    "PolicyError",
    "Problem",
    "PropertyError",
    "Question",
    "QuestionError",
    "RatherthanError",
    "ReachAvoid",
    "Report",
    "Reward",
    "Solution",
    "SourceError",
    "StateNames",
    "StoppedError",
    "Threshold",
    "Tradeoffs",
    "UnsolvedError",
    "Verdicts",
    "World",
    "draw",
    "evaluate",
    "explain",
    "from_json",
    "narrate",
    "parse_property",
    "read",
    "read_policy",
    "report",
    "solve",
    "to_json",
    "tradeoffs",
    "verify",
    "watching",
    "write",
]

_ROOMS = {
    "errors": [name for name in __all__ if name.endswith("Error")],
    "explain": ["Explanation", "Factors", "Question", "explain"],
    "io": ["read", "write"],
    "io.policies": ["read_policy"],
    "model.lexicon": ["Lexicon"],
    "model.mdp": ["MDP", "Reward"],
    "model.names": ["StateNames"],
    "model.objective": [
        "Discounted",
        "ExpectedCost",
        "ExpectedReward",
        "Lexicographic",
        "Mission",
        "ReachAvoid",
        "Threshold",
    ],
    "model.policy": ["Policy"],
    "model.problem": ["Problem"],
    "model.property": ["parse_property"],
    "model.watch": ["Limits", "watching"],
    "model.world": ["World"],
    "narrate": ["from_json", "narrate", "to_json"],
    "render": ["Picture", "draw"],
    "report": ["Report", "report"],
    "solve": ["Outcome", "Solution", "evaluate", "solve"],
    "solve.pareto": ["Tradeoffs", "tradeoffs"],
    "verify": ["Verdicts", "verify"],
}
_HOMES = {name: f"{__name__}.{room}" for room, names in _ROOMS.items() for name in names}


class _Window(types.ModuleType):
    """The module itself. Rooms and verbs share names; the import system hangs a room it loads here: not over a verb."""

    def __setattr__(self, name: str, value: object) -> None:
        if not (name in _HOMES and isinstance(value, types.ModuleType)):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Window

_SHOWN = {
    "explain.explanation": "Explanation",
    "model.mdp": "MDP",
    "model.problem": "Problem",
    "solve.solution": "Solution",
}


def _show_in_notebooks() -> None:
    """Let IPython, where we are in it, show models, solutions and explanations; by name, so that nothing is loaded yet."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    formatter = getattr(shell, "display_formatter", None)
    if formatter is not None:
        for room, name in _SHOWN.items():
            formatter.formatters["text/html"].for_type_by_name(f"{__name__}.{room}", name, _shown)


def _shown(thing: object) -> str:
    found: str = importlib.import_module(f"{__name__}.report.notebook").shown(thing)
    return found


_show_in_notebooks()

if not TYPE_CHECKING:  # to a type checker the names above are all there is

    def __getattr__(name: str) -> object:
        """Return a name of the window, loading its room when it is first asked for."""
        if name == "__version__":
            from importlib.metadata import version

            thing: object = version(__name__)
        elif name in _HOMES:
            thing = getattr(importlib.import_module(_HOMES[name]), name)
        else:
            raise AttributeError(f"module '{__name__}' has no attribute '{name}'", name=name, obj=sys.modules[__name__])
        globals()[name] = thing
        return thing

    def __dir__() -> list[str]:
        """Return the names of the window."""
        return sorted({*globals(), *__all__, "__version__"})
