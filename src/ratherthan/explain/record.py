"""An Explanation enters, a JSON document leaves, and the other way round: equal after the round trip.

Numbers are JSON numbers, ``"inf"`` or ``"-inf"``, never NaN. The document carries the text that was narrated and a digest
of everything else, so that a change is noticed; what it says is re-checked by `ratherthan.verify`.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from typing import Any

from ratherthan.errors import ExplanationError
from ratherthan.explain.explanation import (
    VERSION,
    Claim,
    Closing,
    Evidence,
    Explanation,
    Measured,
    ObjectiveRecord,
    PolicyRecord,
    StateRecord,
    Step,
    Tally,
)
from ratherthan.explain.question import FACTORS, Question
from ratherthan.factors import Interval, Search
from ratherthan.model.lexicon import Lexicon

__all__ = ["digest", "from_document", "number", "to_document"]

Document = dict[str, Any]


def to_document(explanation: Explanation, text: str) -> Document:
    """Return an explanation and its text as a JSON document.

    Parameters
    ----------
    explanation : Explanation
    text : str
        What was narrated.

    Returns
    -------
    dict
        Only dicts, lists, strings, numbers, booleans and None; ``docs/schema/explanation.schema.json`` describes it.
    """
    asked = explanation.question
    document: Document = {
        "version": VERSION,
        "source": explanation.source,
        "property": explanation.property,
        "objective": {
            "kind": explanation.objective.kind,
            "reward": explanation.objective.reward,
            "maximise": explanation.objective.maximise,
        },
        "kind": asked.kind,
        "scope": asked.scope,
        "factors": [factor for factor in FACTORS if factor in asked.factors],
        "state": asked.state,
        "rather_than": asked.rather_than,
        "alpha": asked.alpha,
        "impact": "omega" if asked.omega else "action value",
        "values": "policy" if asked.policy_values else "optimum",
        "search": {"horizon": asked.search.horizon, "toward_goal": asked.search.toward_goal},
        "tolerance": asked.tolerance,
        "detail": asked.detail,
        "text": text,
        "start": explanation.start,
        "route": list(explanation.route),
        "route_outcome": explanation.route_outcome,
        "route_probability": number(explanation.route_probability),
        "arrival_probability": None if explanation.arrival is None else number(explanation.arrival.value),
        "arrival_bounds": None if explanation.arrival is None else _bounds(explanation.arrival),
        "circle": list(explanation.circle),
        "circle_size": explanation.circle_size,
        "circle_certain": explanation.circle_certain,
        "in_the_way": list(explanation.in_the_way),
        "steps": [_step(step, explanation.states) for step in explanation.steps],
        "closing": {
            "printed": explanation.closing.printed,
            "largest_difference": number(explanation.closing.largest_difference),
            "off_route": explanation.closing.off_route,
            "off_route_open": explanation.closing.off_route_open,
        },
        "states": {
            str(state): {"name": record.name, "named": record.named, "place": _listed(record.place)}
            for state, record in sorted(explanation.states.items())
        },
        "model": dict(zip(("states", "choices", "branches"), explanation.size, strict=True)),
        "policy": {
            "given": explanation.policy.given,
            "choices": [[state, choice, share] for state, choice, share in explanation.policy.choices],
        },
        "lexicon": _lexicon(explanation.lexicon),
        "outcome": explanation.outcome,
    }
    document["digest"] = digest(document)
    return document


def digest(document: Mapping[str, Any]) -> str:
    """Return the SHA-256 of a document without its digest, in one canonical spelling."""
    rest = {key: value for key, value in document.items() if key != "digest"}
    spelled = json.dumps(rest, sort_keys=True, separators=(",", ":"), ensure_ascii=True, allow_nan=False)
    return "sha256:" + hashlib.sha256(spelled.encode()).hexdigest()


def number(value: float | None) -> float | int | str | None:
    """Return a number as JSON has it: "inf" and "-inf" for infinities, None for None."""
    if value is None:
        return None
    if math.isnan(value):
        raise ValueError("Not a number has no place in a document.")
    if math.isinf(value):
        return "inf" if value > 0 else "-inf"
    return float(value)


def _bounds(interval: Interval) -> Document:
    return {"lower": number(interval.lower), "upper": number(interval.upper)}


def _interval(interval: Interval) -> Document:
    return {"value": number(interval.value), **_bounds(interval)}


def _listed(place: tuple[int, int] | None) -> list[int] | None:
    return None if place is None else list(place)


def _step(step: Step, states: Mapping[int, StateRecord]) -> Document:
    return {
        "state": step.state,
        "state_name": states[step.state].name,
        "choice": step.choice,
        "choice_index": step.choice_index,
        "action": step.action,
        "share": step.share,
        "critical": step.critical,
        "spread": None if step.spread is None else {"max": _interval(step.spread[0]), "min": _interval(step.spread[1])},
        "foil": step.foil,
        "claims": [
            {"claim": claim.claim, "against": list(claim.against), "evidence": _evidence(claim.evidence)}
            for claim in step.claims
        ],
    }


def _evidence(evidence: Evidence) -> Document:
    document: Document = {"taken": _row(evidence.taken), "others": [_row(other) for other in evidence.others]}
    if evidence.follows:
        document["follows"] = [
            {"state": state, "optimum": _interval(optimum), "policy": _interval(policy)}
            for state, optimum, policy in evidence.follows
        ]
    return document


def _row(row: Measured | Tally) -> Document:
    if isinstance(row, Tally):
        return {"choice": row.choice, "action": row.action, "count": {"lower": row.lower, "upper": row.upper}}
    return {"choice": row.choice, "action": row.action, **_interval(row.number), "fate": row.fate}


def _lexicon(lexicon: Lexicon) -> Document:
    return {
        "language": lexicon.language,
        "actions": dict(lexicon.actions),
        "gerunds": dict(lexicon.gerunds),
        "state": lexicon.state,
        "states": dict(lexicon.states),
        "objectives": {name: dict(words) for name, words in lexicon.objectives.items()},
    }


def from_document(document: Mapping[str, Any]) -> tuple[Explanation, str]:
    """Return the explanation and the text of a JSON document.

    Raises
    ------
    ExplanationError
        If it is of another version, or does not have the form of the schema.
    """
    _check_form(document)
    search = Search(horizon=document["search"]["horizon"], toward_goal=document["search"]["toward_goal"])
    asked = Question(
        kind=document["kind"],
        scope=document["scope"],
        factors=frozenset(document["factors"]),
        state=document["state"],
        rather_than=document["rather_than"],
        alpha=_real(document["alpha"]),
        omega=document["impact"] == "omega",
        policy_values=document["values"] == "policy",
        search=search,
        tolerance=_real(document["tolerance"]),
        detail=document["detail"],
    )
    arrival = document["arrival_bounds"]
    size = document["model"]
    explanation = Explanation(
        source=document["source"],
        property=document["property"],
        objective=ObjectiveRecord(**document["objective"]),
        question=asked,
        start=document["start"],
        route=tuple(document["route"]),
        route_outcome=document["route_outcome"],
        route_probability=_maybe(document["route_probability"]),
        arrival=None if arrival is None else _as_interval({"value": document["arrival_probability"], **arrival}),
        circle=tuple(document["circle"]),
        circle_size=document["circle_size"],
        circle_certain=document["circle_certain"],
        in_the_way=tuple(document["in_the_way"]),
        steps=tuple(_as_step(step) for step in document["steps"]),
        closing=Closing(
            printed=document["closing"]["printed"],
            largest_difference=_maybe(document["closing"]["largest_difference"]),
            off_route=document["closing"]["off_route"],
            off_route_open=document["closing"]["off_route_open"],
        ),
        states={int(state): _as_state(record) for state, record in document["states"].items()},
        size=(size["states"], size["choices"], size["branches"]),
        policy=PolicyRecord(
            given=document["policy"]["given"],
            choices=tuple((s, c, float(p)) for s, c, p in document["policy"]["choices"]),
        ),
        lexicon=Lexicon(**document["lexicon"]),
        outcome=document["outcome"],
    )
    return explanation, document["text"]


def _check_form(document: Mapping[str, Any]) -> None:
    from jsonschema import Draft202012Validator

    from ratherthan.explain.schema import schema

    version = document.get("version") if isinstance(document, Mapping) else None
    if version != VERSION:
        came = "no version" if version is None else f"version {version!r}"
        raise ExplanationError(f"An explanation must be a JSON document of version '{VERSION}', got {came}.")
    faults = sorted(Draft202012Validator(schema()).iter_errors(document), key=lambda fault: list(map(str, fault.path)))
    if faults:
        where = ".".join(map(str, faults[0].absolute_path)) or "the document"
        raise ExplanationError(
            f"An explanation must have the form of its schema; at {where}: {faults[0].message[:200]}."
        )


def _real(value: float | str) -> float:
    return float(value)


def _maybe(value: float | str | None) -> float | None:
    return None if value is None else float(value)


def _as_interval(document: Mapping[str, Any]) -> Interval:
    return Interval(value=_real(document["value"]), lower=_real(document["lower"]), upper=_real(document["upper"]))


def _as_state(record: Mapping[str, Any]) -> StateRecord:
    place = record["place"]
    return StateRecord(
        name=record["name"], named=record["named"], place=None if place is None else (place[0], place[1])
    )


def _as_row(row: Mapping[str, Any]) -> Measured | Tally:
    if "count" in row:
        count = row["count"]
        return Tally(choice=row["choice"], action=row["action"], lower=count["lower"], upper=count["upper"])
    return Measured(choice=row["choice"], action=row["action"], number=_as_interval(row), fate=row["fate"])


def _as_step(step: Mapping[str, Any]) -> Step:
    spread = step["spread"]
    return Step(
        state=step["state"],
        choice=step["choice"],
        choice_index=step["choice_index"],
        action=step["action"],
        share=float(step["share"]),
        critical=step["critical"],
        spread=None if spread is None else (_as_interval(spread["max"]), _as_interval(spread["min"])),
        foil=step["foil"],
        claims=tuple(
            Claim(claim=claim["claim"], against=tuple(claim["against"]), evidence=_as_evidence(claim["evidence"]))
            for claim in step["claims"]
        ),
    )


def _as_evidence(evidence: Mapping[str, Any]) -> Evidence:
    return Evidence(
        taken=_as_row(evidence["taken"]),
        others=tuple(_as_row(other) for other in evidence["others"]),
        follows=tuple(
            (entry["state"], _as_interval(entry["optimum"]), _as_interval(entry["policy"]))
            for entry in evidence.get("follows", ())
        ),
    )
