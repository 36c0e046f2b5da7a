"""Nothing enters, the JSON Schema of a stored explanation leaves (published as docs/schema/explanation.schema.json)."""

from __future__ import annotations

from typing import Any

from ratherthan.explain.explanation import VERSION
from ratherthan.explain.question import FACTORS, RANKINGS

__all__ = ["CLAIMS", "OBJECTIVES", "RELATIONS", "ROUTE_OUTCOMES", "TRADES", "schema"]

CLAIMS = (
    "best",
    "among the best",
    "right start only",
    "not best",
    "hopeless",
    "better step",
    "equal step",
    "worse step",
    "most flexible",
    "equally flexible",
    "avoids",
    "only way on",
    "better",
    "worse",
    "equal",
    "more flexible",
    "less flexible",
    "as flexible",
)

TRADES = ("better on all", "trade", "dominated", "indifferent", "open")

RELATIONS = ("better", "worse", "equal", "open")

OBJECTIVES = (*("cost", "reward", "discounted", "probability", "safety", "deadline", "mission", "risk", "event"),)

ROUTE_OUTCOMES = ("arrives", "there", "ended", "circles", "no way", "open end", "none")

_TEXT = {"type": "string"}
_FLAG = {"type": "boolean"}
_COUNT = {"type": "integer", "minimum": 0}
_NUMBER = {"anyOf": [{"type": "number"}, {"enum": ["inf", "-inf"]}]}
_STATES = {"type": "array", "items": _COUNT}


def _record(properties: dict[str, Any], optional: tuple[str, ...] = ()) -> dict[str, Any]:
    required = [name for name in properties if name not in optional]
    return {"type": "object", "properties": properties, "required": required, "additionalProperties": False}


def _or_null(what: dict[str, Any]) -> dict[str, Any]:
    return {"anyOf": [what, {"type": "null"}]}


def _world() -> dict[str, Any]:
    """Return the form of a map; its cells are deflated bytes in base 64."""
    texts = {"type": "array", "items": _TEXT}
    frame = {name: {"type": "number"} for name in ("resolution", "x", "y", "yaw")}
    road = {"type": "array", "items": _COUNT, "minItems": 2, "maxItems": 2}
    return _record(
        {
            "width": _COUNT,
            "height": _COUNT,
            "kinds": texts,
            "ground": _TEXT,
            "zones": {"type": "object", "additionalProperties": _TEXT},
            "goals": _TEXT,
            "hazards": _TEXT,
            "roads": {"type": "array", "items": road},
            "numbered": _FLAG,
            "frame": _or_null(_record(frame)),
            "title": _TEXT,
            "note": _TEXT,
        }
    )


def schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of an explanation document."""
    bounds = {"lower": _NUMBER, "upper": _NUMBER}
    interval = _record({"value": _NUMBER, **bounds})
    fate = {"enum": ["dead end", "may fail", None]}
    measured = _record({"choice": _COUNT, "action": _TEXT, "value": _NUMBER, **bounds, "fate": fate})
    tally = _record({"choice": _COUNT, "action": _TEXT, "count": _record({"lower": _COUNT, "upper": _COUNT})})
    row = {"anyOf": [measured, tally]}
    follows = {"type": "array", "items": _record({"state": _COUNT, "optimum": interval, "policy": interval})}
    evidence = _record(
        {"taken": row, "others": {"type": "array", "items": row}, "follows": follows}, optional=("follows",)
    )
    texts = {"type": "array", "items": _TEXT}
    claim = _record({"claim": {"enum": list(CLAIMS)}, "level": _COUNT, "against": texts, "evidence": evidence})
    judged = _record(
        {"objective": _COUNT, "taken": measured, "other": measured, "relation": {"enum": list(RELATIONS)}},
    )
    trade = _record(
        {
            "claim": {"enum": list(TRADES)},
            "against": texts | {"minItems": 1, "maxItems": 1},
            "judged": {"type": "array", "items": judged, "minItems": 2},
        }
    )
    spread = _or_null(_record({"max": interval, "min": interval}))
    step = _record(
        {
            "state": _COUNT,
            "state_name": _TEXT,
            "choice": _COUNT,
            "choice_index": _COUNT,
            "action": _TEXT,
            "share": {"type": "number", "exclusiveMinimum": 0, "maximum": 1},
            "critical": {"type": ["boolean", "null"]},
            "spread": spread,
            "further_spreads": {"type": "array", "items": spread},
            "foil": _or_null(_TEXT),
            "claims": {"type": "array", "items": claim},
            "trades": {"type": "array", "items": trade},
            "told": _FLAG,
            "alternatives": {"type": "array", "items": _record({"action": _TEXT, "towards": _COUNT})},
            "rank": _record({"level": _COUNT, "size": _NUMBER, "settled": _FLAG}),
            "numbers": {"type": "array", "items": {"type": "array", "items": measured, "minItems": 1}, "minItems": 1},
        },
        optional=("told", "alternatives", "rank", "numbers"),
    )
    objective = _record(
        {
            "kind": {"enum": list(OBJECTIVES)},
            "reward": _or_null(_TEXT),
            "maximise": _FLAG,
            "discount": _or_null({"type": "number", "exclusiveMinimum": 0, "exclusiveMaximum": 1}),
            "formula": _or_null(_TEXT),
        }
    )
    numbers = {"type": "array", "items": _or_null(_NUMBER)}
    left_out = _record({"steps": {"type": "integer", "minimum": 1}, "unsure": _COUNT, "largest": numbers})
    words = {"type": "object", "additionalProperties": _TEXT}
    place = {"type": "array", "items": {"type": "integer"}, "minItems": 2, "maxItems": 2}
    state_record = _record({"name": _TEXT, "named": _FLAG, "place": _or_null(place)})
    policy_row = {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3}
    document = _record(
        {
            "version": {"const": VERSION},
            "source": _TEXT,
            "property": _TEXT,
            "objective": objective,
            "levels": {"type": "array", "items": objective, "minItems": 1},
            "also": {"type": "array", "items": _record({"property": _TEXT, "objective": objective})},
            "kind": _TEXT,
            "scope": {"enum": ["none", "state", "route"]},
            "factors": {"type": "array", "items": {"enum": list(FACTORS)}, "uniqueItems": True},
            "state": _or_null(_COUNT),
            "rather_than": _or_null(_TEXT),
            "alpha": {"type": "number", "minimum": 0},
            "impact": {"enum": ["action value", "omega"]},
            "values": {"enum": ["optimum", "policy"]},
            "search": _record({"horizon": _or_null(_COUNT), "toward_goal": _FLAG}),
            "tolerance": {"type": "number", "exclusiveMinimum": 0},
            "detail": _FLAG,
            "at_most": {"type": "integer", "minimum": 1},
            "ranking": {"enum": list(RANKINGS)},
            "text": _TEXT,
            "start": _COUNT,
            "route": _STATES,
            "route_outcome": {"enum": list(ROUTE_OUTCOMES)},
            "route_probability": _or_null({"type": "number", "minimum": 0, "maximum": 1}),
            "arrival_probability": _or_null({"type": "number", "minimum": 0, "maximum": 1}),
            "arrival_bounds": _or_null(_record(bounds)),
            "totals": {"type": "array", "items": interval},
            "circle": _STATES,
            "circle_size": _COUNT,
            "circle_certain": _FLAG,
            "in_the_way": _STATES,
            "steps": {"type": "array", "items": step},
            "closing": _record(
                {
                    "printed": _FLAG,
                    "largest_difference": _or_null(_NUMBER),
                    "off_route": _COUNT,
                    "off_route_open": _COUNT,
                    "left_out": left_out,
                },
                optional=("left_out",),
            ),
            "states": {
                "type": "object",
                "patternProperties": {"^[0-9]+$": state_record},
                "additionalProperties": False,
            },
            "model": _record({"states": _COUNT, "choices": _COUNT, "branches": _COUNT}),
            "unfolded": _or_null(_record({"states": _COUNT, "memories": _COUNT})),
            "policy": _record({"given": _FLAG, "choices": {"type": "array", "items": policy_row}}),
            "lexicon": _record(
                {
                    "language": _TEXT,
                    "actions": words,
                    "gerunds": words,
                    "state": _TEXT,
                    "states": words,
                    "objectives": {"type": "object", "additionalProperties": words},
                }
            ),
            "outcome": _TEXT,
            "openings": {
                "type": "array",
                "items": _record({"place": place, "name": _TEXT, "kind": _TEXT}),
                "minItems": 1,
            },
            "world": _world(),
            "digest": {"type": "string", "pattern": "^sha256:[0-9a-f]{64}$"},
        },
        optional=("openings", "world", "at_most", "ranking"),
    )
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "An explanation of a plan by ratherthan",
        **document,
    }
