"""A JSON Schema enters, a quick test leaves that tells whether a document surely has its form.

The test is put together once, out of small functions; a document of thousands of steps passes in a fraction of a second. It is
never more lenient than the schema, and where it says no the full validator has the last word, and the words.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import Any

__all__ = ["Test", "test_of"]

Test = Callable[[Any], bool]

_TYPES: dict[str, Test] = {
    "object": lambda value: type(value) is dict,
    "array": lambda value: type(value) is list,
    "string": lambda value: type(value) is str,
    "boolean": lambda value: type(value) is bool,
    "null": lambda value: value is None,
    "integer": lambda value: type(value) is int,
    "number": lambda value: type(value) is int or type(value) is float,
}
_COMMENTS = {"$schema", "title"}


def test_of(schema: Mapping[str, Any]) -> Test:
    """Return the test of a schema.

    Raises
    ------
    ValueError
        Where the schema has a keyword that is not known here.
    """
    makers: dict[str, Callable[[Any], Test]] = {
        "type": _type,
        "enum": _one_of,
        "const": lambda rule: _one_of([rule]),
        "anyOf": _any_of,
        "items": _items,
        "properties": _properties,
        "required": lambda rule: lambda value: all(name in value for name in rule),
        "additionalProperties": lambda rule: _others(rule, schema),
        "patternProperties": _patterns,
        "minItems": lambda rule: lambda value: len(value) >= rule,
        "maxItems": lambda rule: lambda value: len(value) <= rule,
        "uniqueItems": lambda rule: lambda value: not rule or all(value.index(x) == i for i, x in enumerate(value)),
        "minimum": lambda rule: lambda value: value >= rule,
        "maximum": lambda rule: lambda value: value <= rule,
        "exclusiveMinimum": lambda rule: lambda value: value > rule,
        "exclusiveMaximum": lambda rule: lambda value: value < rule,
        "pattern": _matching,
    }
    unknown = set(schema) - set(makers) - _COMMENTS
    if unknown:
        raise ValueError(f"A schema must have keywords that are known here, got {', '.join(sorted(unknown))}.")
    order = (
        "type",
        *(key for key in schema if key != "type" and key not in _COMMENTS),
    )  # the type is what others rest on
    tests = [makers[key](schema[key]) for key in order if key in schema]
    return tests[0] if len(tests) == 1 else lambda value: all(test(value) for test in tests)


def _type(rule: str | list[str]) -> Test:
    kinds = [_TYPES[name] for name in ([rule] if isinstance(rule, str) else rule)]
    return kinds[0] if len(kinds) == 1 else lambda value: any(kind(value) for kind in kinds)


def _one_of(allowed: list[Any]) -> Test:
    if any(isinstance(entry, int | float) for entry in allowed):  # 1 is not true, though Python has them equal
        raise ValueError("A schema must list text or null, got a number.")
    return lambda value: (value is None or type(value) is str) and value in allowed


def _matching(rule: str) -> Test:
    search = re.compile(rule).search
    return lambda value: search(value) is not None


def _any_of(rules: list[Mapping[str, Any]]) -> Test:
    tests = [test_of(rule) for rule in rules]
    return lambda value: any(test(value) for test in tests)


def _items(rule: Mapping[str, Any]) -> Test:
    test = test_of(rule)
    return lambda value: all(map(test, value))


def _properties(rules: Mapping[str, Any]) -> Test:
    tests = {name: test_of(rule) for name, rule in rules.items()}
    return lambda value: all(name not in value or test(value[name]) for name, test in tests.items())


def _patterns(rules: Mapping[str, Any]) -> Test:
    tests = [(_matching(pattern), test_of(rule)) for pattern, rule in rules.items()]
    return lambda value: all(test(entry) for name, entry in value.items() for fits, test in tests if fits(name))


def _others(rule: bool | Mapping[str, Any], schema: Mapping[str, Any]) -> Test:
    known = frozenset(schema.get("properties", ()))
    patterns = [_matching(pattern) for pattern in schema.get("patternProperties", ())]
    test: Test = (lambda _: bool(rule)) if isinstance(rule, bool) else test_of(rule)
    return lambda value: all(
        name in known or any(fits(name) for fits in patterns) or test(entry) for name, entry in value.items()
    )
