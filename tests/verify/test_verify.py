"""`verify` tells what holds, what fails and what was tampered with, on the paper's map and on small tables."""

from __future__ import annotations

import ast
import copy
import json
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mutations import Mutant, retold, sealed
from random_models import OBJECTIVES, Table, problem_of

import ratherthan
from ratherthan.errors import ExplanationError
from ratherthan.explain import KINDS, explain, question
from ratherthan.explain.record import digest, to_document
from ratherthan.io import read
from ratherthan.model.mdp import MDP
from ratherthan.model.policy import Policy
from ratherthan.model.problem import Problem
from ratherthan.narrate import narrate
from ratherthan.solve import Outcome, evaluate, solve
from ratherthan.verify import Budget, Verdict, Verdicts, verify
from ratherthan.verify.document import OUTCOMES

Document = dict[str, Any]
PAPER = "example:paper-5x5"


@pytest.fixture(scope="module")
def paper() -> Problem:
    return read(PAPER)


@pytest.fixture
def contrastive(paper: Problem) -> Document:
    return told(paper)


def told(problem: Problem, policy: Policy | None = None, **asked: Any) -> Document:
    solution = solve(problem) if policy is None else evaluate(problem, policy)
    explanation = explain(solution, asked=question(**asked))
    return json.loads(json.dumps(to_document(explanation, narrate(explanation))))


def changed(document: Document, change: Callable[[Document], object]) -> Document:
    """Return a document that was changed, with its digest made to fit."""
    forged = copy.deepcopy(document)
    change(forged)
    return sealed(Mutant((), "", forged)).document


def told_anew(document: Document, change: Callable[[Document], object]) -> Document:
    """Return a document that was changed, with its text and its digest made to fit."""
    forged = copy.deepcopy(document)
    change(forged)
    mutant = retold(Mutant((), "", forged))
    assert mutant is not None
    return mutant.document


def failing(verdicts: Verdicts) -> set[str]:
    return {check.what for check in verdicts.of(Verdict.FAILS)}


# -- what is right


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_is_confirmed_on_the_papers_map(paper: Problem, kind: str) -> None:
    state = 10 if KINDS[kind][0] == "state" else None
    verdicts = verify(told(paper, kind=kind, state=state), paper)
    assert verdicts.holds
    assert not verdicts.fails
    assert not verdicts.undecided
    assert verdicts.summary().endswith("contradicted: 0, undecided: 0")


def test_a_foil_is_confirmed(paper: Problem) -> None:
    assert verify(told(paper, rather_than="south", state=10), paper).holds


def test_a_file_is_as_good_as_a_document(paper: Problem, contrastive: Document, tmp_path: Path) -> None:
    path = tmp_path / "route.json"
    path.write_text(json.dumps(contrastive, indent=2), encoding="utf-8")
    assert verify(path, paper) == verify(str(path), paper) == verify(contrastive, paper)


def test_without_work_nothing_is_confirmed_and_nothing_contradicted(paper: Problem, contrastive: Document) -> None:
    verdicts = verify(contrastive, paper, budget=Budget(exact=0, rounds=0))
    assert verdicts.undecided
    assert not verdicts.fails
    assert "best" in {check.what for check in verdicts.of(Verdict.UNDECIDED)}


# -- what was tampered with


@pytest.mark.parametrize(
    "text",
    ["", "{", "[]", '"text"', "{}", '{"version": "1"}', '{"version": NaN}', '{"a": 1, "a": 2}', "[" * 100_000],
)
def test_what_is_no_explanation_is_refused(paper: Problem, tmp_path: Path, text: str) -> None:
    path = tmp_path / "broken.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ExplanationError):
        verify(path, paper)


def test_what_cannot_be_read_is_refused(paper: Problem, tmp_path: Path) -> None:
    (tmp_path / "bytes.json").write_bytes(b"\xff\xfe\x00")
    for path in (tmp_path, tmp_path / "nowhere.json", tmp_path / "bytes.json"):
        with pytest.raises(ExplanationError, match="explanation"):
            verify(path, paper)


FORGED: dict[str, Callable[[Document], object]] = {
    "another version": lambda d: d.update(version="2"),
    "a state as a fraction": lambda d: d["route"].__setitem__(0, 5.0),
    "a state that is not there": lambda d: d["route"].__setitem__(0, 10**30),
    "a number beyond numbers": lambda d: d["steps"][0].__setitem__("share", 10**400),
    "a place of fractions": lambda d: d["states"]["5"].__setitem__("place", [0.5, 1]),
    "a tolerance that makes all equal": lambda d: d.update(tolerance=0.5),
    "a tolerance that makes much equal": lambda d: d.update(tolerance=0.01),
    "another kind": lambda d: d.update(kind="selective"),
    "another outcome": lambda d: d.update(outcome="All is well."),
    "another property": lambda d: d.update(property='Pmax=? [F "destination"]'),
    "a label that is not there": lambda d: d.update(property='R{"distance"}min=? [F "home"]'),
    "a threshold": lambda d: d.update(property='R{"distance"}min<=9 [F "destination"]'),
    "another record of the objective": lambda d: d["objective"].update(maximise=True),
    "another name of a state": lambda d: d["states"]["10"].update(name="the palace"),
    "another place of a state": lambda d: d["states"]["10"].update(place=[9, 9]),
    "another name of an action": lambda d: d["steps"][0].update(action="north"),
    "another number of a choice": lambda d: d["steps"][0].update(choice_index=1),
    "another text": lambda d: d.update(text=d["text"].replace("shortest", "longest")),
    "a state without a record": lambda d: d["states"].pop("10"),
    "a state name that is not its own": lambda d: d["steps"][0].update(state_name="10"),
    "an arrival without bounds": lambda d: d.update(arrival_bounds=None),
    "an unknown field": lambda d: d.update(note="trust me"),
    "other actions than those of the evidence": lambda d: d["steps"][0]["claims"][0].update(against=["west"]),
}


@pytest.mark.parametrize("how", FORGED)
def test_what_contradicts_itself_or_is_not_of_the_model_is_refused(
    paper: Problem, contrastive: Document, how: str
) -> None:
    with pytest.raises(ExplanationError):
        verify(changed(contrastive, FORGED[how]), paper)


def test_a_changed_word_is_refused_by_the_digest(paper: Problem, contrastive: Document) -> None:
    contrastive["text"] = contrastive["text"].replace("east", "west")
    with pytest.raises(ExplanationError, match="digest"):
        verify(contrastive, paper)


# -- what the model contradicts, though the text fits


def claim(document: Document, state: int, name: str) -> Document:
    step = next(step for step in document["steps"] if step["state"] == state)
    return next(found for found in step["claims"] if found["claim"] == name)


def at(document: Document, state: int) -> Document:
    return next(step for step in document["steps"] if step["state"] == state)


LIES: dict[str, tuple[str, Callable[[Document], object]]] = {
    "an uncritical step": ("critical", lambda d: at(d, 10).update(critical=False, claims=[])),
    "a critical step": ("critical", lambda d: at(d, 11).update(critical=True)),
    "a step left open": ("critical", lambda d: at(d, 10).update(critical=None)),
    "among the best": ("among the best", lambda d: claim(d, 10, "best").update(claim="among the best")),
    "not best": ("not best", lambda d: claim(d, 10, "best").update(claim="not best")),
    "another number": (
        "best",
        lambda d: claim(d, 10, "best")["evidence"]["others"][0].update(value=20.0, lower=20.0, upper=20.0),
    ),
    "wider bounds": ("best", lambda d: claim(d, 10, "best")["evidence"]["others"][0].update(lower=9.0)),
    "another value at a successor": (
        "best",
        lambda d: claim(d, 10, "best")["evidence"]["follows"][0]["optimum"].update(value=5.0, lower=5.0, upper=5.0),
    ),
    "another fate": ("avoids", lambda d: claim(d, 5, "avoids")["evidence"]["others"][0].update(fate="dead end")),
    "another count": (
        "most flexible",
        lambda d: claim(d, 10, "most flexible")["evidence"]["taken"].update(count={"lower": 6, "upper": 6}),
    ),
    "a claim twice": ("claims", lambda d: at(d, 10)["claims"].append(claim(d, 10, "best"))),
    "a detail left out": ("claims", lambda d: at(d, 5)["claims"].remove(claim(d, 5, "avoids"))),
    "another threshold": ("critical", lambda d: d.update(alpha=5.0)),
    "another measure": ("critical", lambda d: d.update(impact="omega")),
    "another horizon": ("most flexible", lambda d: d["search"].update(horizon=0)),
    "a more probable route": ("route_probability", lambda d: d.update(route_probability=0.5)),
    "a less probable arrival": (
        "arrival_probability",
        lambda d: d.update(arrival_probability=0.25, arrival_bounds={"lower": 0.25, "upper": 0.25}),
    ),
    "decisions off the route": ("closing", lambda d: d["closing"].update(off_route=3)),
    "a larger difference": ("closing", lambda d: d["closing"].update(largest_difference=2.0, printed=False)),
    "another policy": ("policy", lambda d: d["policy"]["choices"].__setitem__(4, [10, 13, 1.0])),
    "a policy with a gap": ("policy", lambda d: d["policy"]["choices"].pop()),
    "a policy of another state's choice": ("policy", lambda d: d["policy"]["choices"].__setitem__(0, [3, 9, 1.0])),
    "a start elsewhere": ("start", lambda d: d.update(start=10, route=d["route"][1:], steps=d["steps"][1:])),
    "a route cut short": ("route", lambda d: d.update(route=d["route"][:-1], steps=d["steps"][:-1])),
    "another model": ("model", lambda d: d["model"].update(branches=57)),
}


@pytest.mark.parametrize("how", LIES)
def test_what_the_model_contradicts_fails(paper: Problem, contrastive: Document, how: str) -> None:
    what, change = LIES[how]
    verdicts = verify(told_anew(contrastive, change), paper)
    assert what in failing(verdicts)
    assert all(check.reason for check in verdicts.of(Verdict.FAILS))
    assert verdicts.fails


def test_a_model_that_changed_since_is_found(paper: Problem, contrastive: Document) -> None:
    mdp = paper.mdp
    slower = np.where(mdp.branch_to_probability == 0.9, 0.8, mdp.branch_to_probability)
    slower = np.where(np.isclose(slower, 0.1), 0.2, slower)
    assert failing(verify(contrastive, with_probabilities(paper, slower))) >= {"best", "critical"}


def with_probabilities(problem: Problem, probability: Any) -> Problem:
    mdp = problem.mdp
    other = MDP(
        state_to_choices=mdp.state_to_choices,
        choice_to_branches=mdp.choice_to_branches,
        branch_to_target=mdp.branch_to_target,
        branch_to_probability=probability,
        choice_to_action=mdp.choice_to_action,
        actions=mdp.actions,
        labels=mdp.labels,
        rewards=mdp.rewards,
        initial=mdp.initial,
        names=mdp.names,
    )
    return replace(problem, mdp=other)


# -- policies and routes

FORK: Table = {
    0: {"left": ([(0.9, 1), (0.1, 0)], 1.0), "right": ([(1.0, 2)], 1.0)},
    1: {"on": ([(1.0, 3)], 1.0), "back": ([(1.0, 0)], 1.0)},
    2: {"on": ([(1.0, 3)], 4.0), "rest": ([(1.0, 2)], 1.0)},
    3: {"stay": ([(1.0, 3)], 0.0)},
}


def fork(objective: str = "least cost") -> Problem:
    return problem_of(FORK, OBJECTIVES[objective], goals=[3])


def test_a_bad_policy_is_told_as_what_it_is() -> None:
    document = told(fork(), Policy(choice=np.array([1, 2, 4, 6])))
    assert verify(document, fork()).holds
    better = told_anew(document, lambda d: claim(d, 0, "not best").update(claim="best"))
    assert "best" in failing(verify(better, fork()))


def test_a_policy_that_goes_round_is_told_as_what_it_is() -> None:
    document = told(fork(), Policy(choice=np.array([0, 3, 4, 6])))
    assert document["route_outcome"] == "circles"
    assert verify(document, fork()).holds
    for change in (
        lambda d: d.update(circle=[0], circle_size=1),
        lambda d: d.update(circle_certain=False),
        lambda d: d.update(route_outcome="arrives"),
    ):
        assert "route" in failing(verify(told_anew(document, change), fork()))


def test_a_policy_passed_off_as_the_optimum_fails() -> None:
    document = told(fork(), Policy(choice=np.array([1, 2, 4, 6])), kind="naive-path")
    forged = told_anew(document, lambda d: d["policy"].update(given=False))
    assert failing(verify(forged, fork())) == {"optimum"}


def test_shares_of_a_randomised_policy_are_checked() -> None:
    chance = np.array([0.75, 0.25, 1.0, 0.0, 1.0, 0.0, 1.0])
    document = told(fork(), Policy(choice=np.full(4, -1), chance=chance), kind="naive-path")
    assert verify(document, fork()).holds
    forged = told_anew(document, lambda d: d["steps"][0].update(share=0.5))
    assert "choice" in failing(verify(forged, fork()))
    forged = told_anew(document, lambda d: d["policy"]["choices"].__setitem__(0, [0, 0, 0.5]))
    assert "policy" in failing(verify(forged, fork()))


def test_of_equally_probable_ways_the_first_listed_is_the_route() -> None:
    table: Table = {
        0: {"go": ([(0.5, 1), (0.5, 2)], 1.0)},
        1: {"on": ([(1.0, 3)], 1.0)},
        2: {"on": ([(1.0, 3)], 1.0)},
        3: {"stay": ([(1.0, 3)], 0.0)},
    }
    problem = problem_of(table, OBJECTIVES["least cost"], goals=[3])
    document = told(problem, kind="naive-path")
    assert document["route"] == [0, 1, 3]
    other = {
        "state": 2,
        "state_name": "2",
        "choice": 2,
        "choice_index": 0,
    }

    def swap(forged: Document) -> None:
        forged["route"] = [0, 2, 3]
        forged["states"]["2"] = forged["states"].pop("1") | {"name": "2"}
        forged["steps"][1] |= other

    assert "route" in failing(verify(told_anew(document, swap), problem))


def test_hazards_in_the_way_are_those_on_a_shortest_way() -> None:
    table: Table = {
        0: {"east": ([(1.0, 1)], 1.0), "south": ([(1.0, 2)], 1.0)},
        1: {"on": ([(1.0, 3)], 1.0)},
        2: {"on": ([(1.0, 1)], 1.0)},
        3: {"stay": ([(1.0, 3)], 0.0)},
    }
    problem = problem_of(table, OBJECTIVES["safest"], goals=[3], hazards=[1])
    document = told(problem)
    assert document["route_outcome"] == "no way"
    assert document["in_the_way"] == [1]
    assert verify(document, problem).holds
    assert "route" in failing(verify(told_anew(document, lambda d: d.update(in_the_way=[2])), problem))
    assert "route" in failing(verify(told_anew(document, lambda d: d.update(in_the_way=[])), problem))


# -- independence


def test_nothing_of_solvers_factors_and_claims_is_imported() -> None:
    folder = Path(ratherthan.__file__).parent / "verify"
    allowed = {"ratherthan.explain.explanation", "ratherthan.explain.question", "ratherthan.explain.record"}
    for path in folder.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            names += [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            for name in names:
                room = ".".join(name.split(".")[:2])
                assert room not in {"ratherthan.solve", "ratherthan.factors"}, (path.name, name)
                assert room != "ratherthan.explain" or name in allowed, (path.name, name)


def test_the_outcomes_are_the_solvers() -> None:
    assert {outcome.value for outcome in Outcome} == set(OUTCOMES)
    assert OUTCOMES[0] == Outcome.CERTIFIED.value


def test_where_only_a_limited_number_of_steps_is_bounded_no_claim_rests_on_it() -> None:
    """The bounds from above say nothing then: no action is called best, whatever the values are."""
    table: Table = {
        0: {"risky": ([(0.5, 2), (0.5, 3)], 0.0), "safe": ([(0.9, 1), (0.1, 3)], 0.0)},
        1: {"on": ([(0.9, 2), (0.1, 3)], 0.0)},
        2: {"stay": ([(1.0, 2)], 0.0)},
        3: {"stay": ([(1.0, 3)], 0.0)},
    }
    problem = problem_of(table, OBJECTIVES["safest"], goals=[2], hazards=[3])
    whole = solve(problem)
    within = np.minimum(whole.upper[0] + 1e-7, 1.0)
    known = np.array([[False, False, True, True]])
    limited = replace(
        whole,
        outcome=Outcome.HORIZON,
        upper=np.where(known, whole.upper, 1.0),
        policy_upper=np.where(known, whole.policy_upper, 1.0),
        horizon=100_000,
        within=within,
    )
    found = {}
    for solution in (whole, limited):
        explanation = explain(solution)
        document = json.loads(json.dumps(to_document(explanation, narrate(explanation))))
        assert not verify(document, problem).fails
        found[solution.outcome] = {claim["claim"] for step in document["steps"] for claim in step["claims"]}
        assert document["outcome"] == solution.outcome.value
    assert "best" in found[Outcome.CERTIFIED]
    assert not found[Outcome.HORIZON] & {"best", "among the best", "right start only", "not best"}
    assert "100,000" not in document["text"]


def test_the_digest_covers_everything_but_itself(contrastive: Document) -> None:
    assert contrastive["digest"] == digest(contrastive)
    for key in contrastive:
        if key != "digest":
            assert digest({k: v for k, v in contrastive.items() if k != key}) != contrastive["digest"]


def test_a_small_model_is_verified_without_heavy_libraries(contrastive: Document, tmp_path: Path) -> None:
    (tmp_path / "route.json").write_text(json.dumps(contrastive), encoding="utf-8")
    program = f"""
import sys
from ratherthan.io import read
from ratherthan.verify import verify
assert verify({str(tmp_path / "route.json")!r}, read({PAPER!r})).holds
print([name for name in ("numba", "scipy.sparse", "stormpy", "pyarrow") if name in sys.modules])
"""
    found = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"
