"""The text of a source, ``FrozenLake-v1,map_name=8x8``, enters; a name and arguments leave."""

from __future__ import annotations

import json
import math
import re
from typing import Any

from ratherthan.errors import SourceError

__all__ = ["split_source"]

WORDS = {"true": True, "false": False, "none": None, "null": None}
WHOLE = re.compile(r"[+-]?\d{1,18}")
FRACTION = re.compile(r"([+-]?\d{1,15})/(\d{1,15})")
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d{1,3})?")


def split_source(text: str) -> tuple[str, dict[str, Any]]:
    """Return the name of an environment and the arguments after it.

    Parameters
    ----------
    text : str
        The name; then, after commas, ``key=value``. Commas within quotes and brackets separate nothing.

    Raises
    ------
    SourceError
        Where there is no name, an argument is none, or comes twice.

    Examples
    --------
    >>> split_source("FrozenLake-v1,map_name=8x8,is_slippery=false,success_rate=1/4")
    ('FrozenLake-v1', {'map_name': '8x8', 'is_slippery': False, 'success_rate': 0.25})
    >>> split_source("FrozenLake-v1,desc=[SFF,FHF,FFG]")
    ('FrozenLake-v1', {'desc': ['SFF', 'FHF', 'FFG']})
    """
    name, *parts = _split(text)
    if not name.strip():
        raise SourceError(f"An environment must be named after 'gym:', as in gym:FrozenLake-v1; got 'gym:{text}'.")
    arguments: dict[str, Any] = {}
    for part in parts:
        key, equals, value = part.partition("=")
        key = key.strip()
        if not equals or not key.isidentifier():
            raise SourceError(
                f"An argument of an environment must read key=value, as in gym:FrozenLake-v1,map_name=8x8; got '{part}' in "
                f"'gym:{text}'."
            )
        if key in arguments:
            raise SourceError(f"An argument must be given once, got '{key}' twice in 'gym:{text}'.")
        arguments[key] = _value(value.strip())
    return name.strip(), arguments


def _split(text: str) -> list[str]:
    """Split at the commas that stand outside quotes and brackets."""
    parts, depth, quoted = [""], 0, False
    for character in text:
        if character == '"':
            quoted = not quoted
        elif not quoted:
            depth += (character == "[") - (character == "]")
        if character == "," and depth <= 0 and not quoted:
            parts.append("")
        else:
            parts[-1] += character
    return parts


def _value(text: str) -> Any:
    """Return what a value says: a number, a fraction, true, false, none, JSON, a list; else the text itself."""
    if text.lower() in WORDS:
        return WORDS[text.lower()]
    if WHOLE.fullmatch(text):
        return int(text)
    if NUMBER.fullmatch(text) and math.isfinite(float(text)):
        return float(text)
    fraction = FRACTION.fullmatch(text)
    if fraction and int(fraction[2]):
        return int(fraction[1]) / int(fraction[2])
    if text[:1] in ('"', "[", "{"):
        try:
            return json.loads(text)
        except (ValueError, RecursionError):
            pass  # not JSON: a list without quotes, or text after all
    if text.startswith("[") and text.endswith("]") and len(text) > 2:
        return [_value(part.strip()) for part in _split(text[1:-1])]
    return text
