"""A JSON document enters, the Explanation that was written leaves."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

from ratherthan.errors import ExplanationError
from ratherthan.explain.explanation import (
    VERSION,
    Alternative,
    Claim,
    Closing,
    Evidence,
    Explanation,
    Further,
    Judged,
    LeftOut,
    Measured,
    ObjectiveRecord,
    Opening,
    PolicyRecord,
    PolicyRows,
    Rank,
    StateRecord,
    Step,
    Tally,
    Trade,
    Unfolded,
)
from ratherthan.explain.form import Test, test_of
from ratherthan.explain.places import world_from_json
from ratherthan.explain.question import Question
from ratherthan.factors import Interval, Search
from ratherthan.model.lexicon import Lexicon

__all__ = ["from_document"]


def from_document(document: Mapping[str, Any]) -> tuple[Explanation, str]:
    """Return the explanation and the text of a JSON document.

    Raises
    ------
    ExplanationError
        If it is of another version, or does not have the form of the schema.
    """
    rows = _check_form(document)
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
        at_most=document.get("at_most"),
        ranking=document.get("ranking", "detour"),
    )
    arrival = document["arrival_bounds"]
    size = document["model"]
    explanation = Explanation(
        source=document["source"],
        property=document["property"],
        objective=ObjectiveRecord(**document["objective"]),
        levels=tuple(ObjectiveRecord(**level) for level in document["levels"]),
        also=tuple(
            Further(property=further["property"], objective=ObjectiveRecord(**further["objective"]))
            for further in document["also"]
        ),
        totals=tuple(_as_interval(total) for total in document["totals"]),
        unfolded=None if document["unfolded"] is None else Unfolded(**document["unfolded"]),
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
        openings=tuple(
            Opening(place=(cell["place"][0], cell["place"][1]), name=cell["name"], kind=cell["kind"])
            for cell in document.get("openings", ())
        ),
        steps=tuple(_as_step(step) for step in document["steps"]),
        closing=Closing(
            printed=document["closing"]["printed"],
            largest_difference=_maybe(document["closing"]["largest_difference"]),
            off_route=document["closing"]["off_route"],
            off_route_open=document["closing"]["off_route_open"],
            left_out=_as_left_out(document["closing"].get("left_out")),
        ),
        states={int(state): _as_state(record) for state, record in document["states"].items()},
        size=(size["states"], size["choices"], size["branches"]),
        policy=PolicyRecord(given=document["policy"]["given"], choices=rows),
        lexicon=Lexicon(**document["lexicon"]),
        outcome=document["outcome"],
        world=world_from_json(document["world"]) if "world" in document else None,
    )
    return explanation, document["text"]


def _check_form(document: Mapping[str, Any]) -> PolicyRows:
    """Raise where a document has not the form of the schema; return its policy, which is checked as columns."""
    version = document.get("version") if isinstance(document, Mapping) else None
    if version != VERSION:
        came = "no version" if version is None else f"version {version!r}"
        raise ExplanationError(f"An explanation must be a JSON document of version '{VERSION}', got {came}.")
    policy = document.get("policy")
    listed = policy.get("choices") if isinstance(policy, Mapping) else None
    rows = _rows(listed)
    if rows is not None and isinstance(policy, Mapping):  # then its rows are in order, and need not be looked at again
        document = {**document, "policy": {**policy, "choices": []}}
    if not _test()(document):
        _refuse_form(document)
    if rows is None:
        odd = next(number for row in listed or () for number in row[:2] if type(number) is not int)
        raise ExplanationError(f"A state, choice or count must be a whole number at policy, got {odd!r}.")
    return rows


def _rows(listed: object) -> PolicyRows | None:
    """Return the rows of a policy; None where some are no [whole number, whole number, number]."""
    if not isinstance(listed, list) or not set(map(type, listed)) <= {list} or not set(map(len, listed)) <= {3}:
        return None
    try:
        return PolicyRows.of(listed)
    except TypeError:
        return None
    except OverflowError:
        raise ExplanationError("A state, choice or count must be a number of at most 64 bits at policy.") from None


@cache
def _test() -> Test:
    from ratherthan.explain.schema import schema

    return test_of(schema())


def _refuse_form(document: Mapping[str, Any]) -> None:
    """Raise with the first place where a document has not the form of the schema."""
    from jsonschema import Draft202012Validator

    from ratherthan.explain.schema import schema

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


def _as_left_out(left: Mapping[str, Any] | None) -> LeftOut | None:
    if left is None:
        return None
    return LeftOut(steps=left["steps"], unsure=left["unsure"], largest=tuple(_maybe(most) for most in left["largest"]))


def _as_rank(rank: Mapping[str, Any] | None) -> Rank | None:
    if rank is None:
        return None
    return Rank(level=rank["level"], size=_real(rank["size"]), settled=rank["settled"])


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
    return _as_measured(row)


def _as_measured(row: Mapping[str, Any]) -> Measured:
    return Measured(choice=row["choice"], action=row["action"], number=_as_interval(row), fate=row["fate"])


def _as_spread(spread: Mapping[str, Any] | None) -> tuple[Interval, Interval] | None:
    return None if spread is None else (_as_interval(spread["max"]), _as_interval(spread["min"]))


def _as_trade(trade: Mapping[str, Any]) -> Trade:
    return Trade(
        claim=trade["claim"],
        against=tuple(trade["against"]),
        judged=tuple(
            Judged(
                objective=one["objective"],
                taken=_as_measured(one["taken"]),
                other=_as_measured(one["other"]),
                relation=one["relation"],
            )
            for one in trade["judged"]
        ),
    )


def _as_step(step: Mapping[str, Any]) -> Step:
    return Step(
        state=step["state"],
        choice=step["choice"],
        choice_index=step["choice_index"],
        action=step["action"],
        share=float(step["share"]),
        critical=step["critical"],
        spread=_as_spread(step["spread"]),
        further_spreads=tuple(_as_spread(spread) for spread in step["further_spreads"]),
        foil=step["foil"],
        claims=tuple(
            Claim(
                claim=claim["claim"],
                level=claim["level"],
                against=tuple(claim["against"]),
                evidence=_as_evidence(claim["evidence"]),
            )
            for claim in step["claims"]
        ),
        trades=tuple(_as_trade(trade) for trade in step["trades"]),
        told=step.get("told", True),
        alternatives=tuple(Alternative(**other) for other in step.get("alternatives", ())),
        rank=_as_rank(step.get("rank")),
        numbers=tuple(tuple(map(_as_measured, level)) for level in step.get("numbers", ())),
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
