"""A value enters, the text of its cell in a table leaves, and back: no spreadsheet takes what people typed for a formula."""

from __future__ import annotations

import re
from typing import Any

__all__ = ["bare_cell", "safe_cell"]

NUMBER = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?", re.ASCII)
FORMULAS = ("=", "+", "-", "@", "\t", "\r", "\uff1d", "\uff0b", "\uff0d", "\uff20")
"""What a formula can start with; the last four are as wide as Chinese characters are."""


def safe_cell(value: Any) -> str:
    """Return a value as a cell of CSV that no spreadsheet takes for a formula.

    Examples
    --------
    >>> safe_cell("=1+1"), safe_cell("-3"), safe_cell(None), safe_cell(True)
    ("'=1+1", '-3', '', 'true')
    """
    if value is None:
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    text = str(value)
    return f"'{text}" if text.lstrip("'").startswith(FORMULAS) and not NUMBER.fullmatch(text) else text


def bare_cell(cell: str) -> str:
    """Return a cell without the quote that `safe_cell` sets before it.

    Examples
    --------
    >>> bare_cell("'=1+1"), bare_cell("-3"), bare_cell("'tis"), bare_cell(safe_cell("'=1"))
    ('=1+1', '-3', "'tis", "'=1")
    """
    return cell[1:] if cell.startswith("'") and cell.lstrip("'").startswith(FORMULAS) else cell
