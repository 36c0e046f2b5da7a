"""Explanations enter, sentences leave: templates and lexicons are data."""

from ratherthan.narrate.document import from_json, to_json
from ratherthan.narrate.narrate import narrate, sentences
from ratherthan.narrate.sentence import Sentence

__all__ = ["Sentence", "from_json", "narrate", "sentences", "to_json"]
