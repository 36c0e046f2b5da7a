"""What cannot be taken enters, one answer leaves: a place, a kind and a sentence, never what came."""

from __future__ import annotations

from typing import Any

__all__ = ["RefusedError"]


class RefusedError(Exception):
    """A request that is not done.

    Parameters
    ----------
    status : int
        Of HTTP.
    place : str
        Where the fault is: "body", "values.trust", "token".
    kind : str
        What programs read: "missing", "length", "order".
    sentence : str
        What people read. It never holds what came.
    """

    def __init__(self, status: int, place: str, kind: str, sentence: str) -> None:
        super().__init__(sentence)
        self.status, self.place, self.kind, self.sentence = status, place, kind, sentence

    def document(self) -> dict[str, Any]:
        """Return the body of the answer."""
        return {"error": {"place": self.place, "kind": self.kind, "sentence": self.sentence}}
