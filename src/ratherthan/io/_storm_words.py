"""The text of a property in PRISM's syntax enters, its words leave; and the parts of a filter around it."""

from __future__ import annotations

import re

__all__ = ["CLOSED", "OPEN", "outer_filter", "words_of"]

_WORDS = re.compile(
    r'"[^"\n]*"|(?:\d+\.\d+|\d+\.(?!\.)|\.\d+|\d+)(?:[eE][+-]?\d+)?|[^\W\d]\w*(?:\.[^\W\d]\w*)*'
    r"|=\s*\?|<=>|=>|<=|>=|!=|\|\||&&|\S"
)
_COMMENT = re.compile(r'("[^"\n]*")|//[^\n]*')
_TITLE = re.compile(r'\s*"[^"\n]*"\s*:')
OPEN, CLOSED = ("(", "[", "{"), (")", "]", "}")


def outer_filter(text: str) -> tuple[str, str, str] | None:
    """Return the parts of ``filter(avg, property, states)``: the operator, the property and the states; else None."""
    words = words_of(text)
    if words[:2] != ["filter", "("] or words[-1] != ")":
        return None
    parts, depth, begin = [], 0, 2
    for i in range(2, len(words)):
        depth += (words[i] in OPEN) - (words[i] in CLOSED)
        if depth < 0 or (depth == 0 and words[i] == ","):
            parts.append(" ".join(words[begin:i]))
            begin = i + 1
    if begin != len(words) or not 2 <= len(parts) <= 3:
        return None
    return parts[0], parts[1], parts[2] if len(parts) == 3 else "true"


def words_of(text: str) -> list[str]:
    """Return the words of a property, without comments, a name before it and semicolons behind it."""
    text = _COMMENT.sub(lambda found: found[1] or " ", text)
    words = _WORDS.findall(_TITLE.sub("", text, count=1))
    words = ["=?" if word[0] == "=" and word[-1] == "?" else "&" if word == "&&" else word for word in words]
    while words and words[-1] == ";":
        words.pop()
    return words
