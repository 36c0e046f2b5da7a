"""Cells of tables: none is a formula for a spreadsheet, and each comes back as it was."""

import pytest

from ratherthan.apps.study.cells import bare_cell, safe_cell

CELLS = [
    ("=1", "'=1"),
    ("+1", "+1"),
    ("-1.5", "-1.5"),
    ("-1+2", "'-1+2"),
    ("@x", "'@x"),
    ("\tx", "'\tx"),
    ("\uff1dSUM(A1)", "'\uff1dSUM(A1)"),
    ("\uff20x", "'\uff20x"),
    ("'=1", "''=1"),
    ("'tis", "'tis"),
    ("plain", "plain"),
    ("", ""),
]


@pytest.mark.parametrize(("value", "cell"), CELLS)
def test_cells_are_safe_and_come_back(value, cell):
    assert safe_cell(value) == cell
    assert bare_cell(cell) == value


@pytest.mark.parametrize(("value", "cell"), [(None, ""), (-3, "-3"), (2.5, "2.5"), (False, "false"), (True, "true")])
def test_what_is_no_text_is_written_plainly(value, cell):
    assert safe_cell(value) == cell
