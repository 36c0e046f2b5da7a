"""An Explanation enters, a JSON document leaves; `ratherthan.explain.reading` goes the other way: equal after the round trip.

Numbers are JSON numbers, ``"inf"`` or ``"-inf"``, never NaN. The document carries the text that was narrated and a digest
of everything else, so that a change is noticed; what it says is re-checked by `ratherthan.verify`.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from ratherthan.explain.explanation import (
    VERSION,
    Evidence,
    Explanation,
    Judged,
    LeftOut,
    Measured,
    StateRecord,
    Step,
    Tally,
)
from ratherthan.explain.places import world_to_json
from ratherthan.explain.question import FACTORS
from ratherthan.explain.reading import from_document
from ratherthan.factors import Interval
from ratherthan.model.lexicon import Lexicon

__all__ = ["digest", "digest_of", "frame_of", "from_document", "number", "to_document"]

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
    document = frame_of(explanation, text)
    document["policy"]["choices"] = list(map(list, explanation.policy.rows))
    document["digest"] = digest_of(explanation, document)
    return document


def frame_of(explanation: Explanation, text: str) -> Document:
    """Return the document of an explanation without the choices of its policy, which may be a million, and without its digest."""
    asked = explanation.question
    return {
        "version": VERSION,
        "source": explanation.source,
        "property": explanation.property,
        "objective": asdict(explanation.objective),
        "levels": [asdict(level) for level in explanation.levels],
        "also": [asdict(further) for further in explanation.also],
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
        **({} if asked.at_most is None else {"at_most": asked.at_most, "ranking": asked.ranking}),
        "text": text,
        "start": explanation.start,
        "route": list(explanation.route),
        "route_outcome": explanation.route_outcome,
        "route_probability": number(explanation.route_probability),
        "arrival_probability": None if explanation.arrival is None else number(explanation.arrival.value),
        "arrival_bounds": None if explanation.arrival is None else _bounds(explanation.arrival),
        "totals": [_interval(total) for total in explanation.totals],
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
            **_left_out(explanation.closing.left_out),
        },
        "states": {
            str(state): {"name": record.name, "named": record.named, "place": _listed(record.place)}
            for state, record in sorted(explanation.states.items())
        },
        "model": dict(zip(("states", "choices", "branches"), explanation.size, strict=True)),
        "unfolded": None if explanation.unfolded is None else asdict(explanation.unfolded),
        "policy": {
            "given": explanation.policy.given,
            "choices": [],
        },
        "lexicon": _lexicon(explanation.lexicon),
        "outcome": explanation.outcome,
        **_openings(explanation),
        **({} if explanation.world is None else {"world": world_to_json(explanation.world)}),
    }


def _openings(explanation: Explanation) -> dict[str, Any]:
    """Return the closed cells that would have to open; nothing where there are none."""
    listed = [{"place": list(cell.place), "name": cell.name, "kind": cell.kind} for cell in explanation.openings]
    return {"openings": listed} if listed else {}


def _left_out(left: LeftOut | None) -> Document:
    """Return what is known of the steps that matter and are not told; nothing where there are none."""
    if left is None:
        return {}
    largest = [number(most) for most in left.largest]
    return {"left_out": {"steps": left.steps, "unsure": left.unsure, "largest": largest}}


def digest(document: Mapping[str, Any]) -> str:
    """Return the SHA-256 of a document without its digest, in one canonical spelling."""
    return _hashed(_canonical(document))


def digest_of(explanation: Explanation, document: Mapping[str, Any]) -> str:
    """Return the same of the document of an explanation, whatever stands there in the place of the policy's choices."""
    rest = {key: value for key, value in document.items() if key != "digest"}
    head, own, tail = _canonical(rest | {"policy": document["policy"] | {"choices": []}}).partition(_NO_CHOICES)
    return _hashed(head, own[:-2], explanation.policy.rows.spelled(), tail)


_NO_CHOICES = '"policy":{"choices":[]'
"""It stands once in the canonical spelling: quotation marks within a text are escaped."""


def _canonical(document: Mapping[str, Any]) -> str:
    rest = {key: value for key, value in document.items() if key != "digest"}
    return json.dumps(rest, sort_keys=True, separators=(",", ":"), ensure_ascii=True, allow_nan=False)


def _hashed(*parts: str) -> str:
    found = hashlib.sha256()
    for part in parts:
        found.update(part.encode())
    return "sha256:" + found.hexdigest()


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
        "spread": _spread(step.spread),
        "further_spreads": [_spread(spread) for spread in step.further_spreads],
        "foil": step.foil,
        "claims": [
            {
                "claim": claim.claim,
                "level": claim.level,
                "against": list(claim.against),
                "evidence": _evidence(claim.evidence),
            }
            for claim in step.claims
        ],
        "trades": [
            {"claim": trade.claim, "against": list(trade.against), "judged": [_judged(one) for one in trade.judged]}
            for trade in step.trades
        ],
        **({} if step.told else {"told": False}),
        **({"alternatives": [asdict(other) for other in step.alternatives]} if step.alternatives else {}),
        **({} if step.rank is None else {"rank": asdict(step.rank) | {"size": number(step.rank.size)}}),
        **({"numbers": [[_row(row) for row in level] for level in step.numbers]} if step.numbers else {}),
    }


def _spread(spread: tuple[Interval, Interval] | None) -> Document | None:
    return None if spread is None else {"max": _interval(spread[0]), "min": _interval(spread[1])}


def _judged(judged: Judged) -> Document:
    return {
        "objective": judged.objective,
        "taken": _row(judged.taken),
        "other": _row(judged.other),
        "relation": judged.relation,
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
