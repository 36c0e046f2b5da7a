"""An archive of the Unified Markov Binary format (``.umb``) enters, a Problem leaves, and back."""

from __future__ import annotations

from ratherthan.io.umb_read import read_umb
from ratherthan.io.umb_write import write_umb

__all__ = ["read_umb", "write_umb"]
