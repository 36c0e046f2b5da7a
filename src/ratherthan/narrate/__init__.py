"""Explanations enter, sentences leave: templates and lexicons are data."""

from ratherthan.narrate.document import from_json, to_json
from ratherthan.narrate.narrate import narrate

__all__ = ["from_json", "narrate", "to_json"]
