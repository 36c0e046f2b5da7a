"""The grammars of formulas and properties: free of ambiguity, complete in their refusals, and the same from the cache."""

from __future__ import annotations

import logging
from pathlib import Path

import pytest
from lark import Lark, logger

from ratherthan.errors import PropertyError
from ratherthan.model import reading
from ratherthan.model.syntax import Term, text_of
from ratherthan.model.temporal import REFUSED

GRAMMARS = ("formula", "property")
TEXTS = {"formula": '!x = 1 & "goal"', "property": 'Pmax=? [!x = 1 U "goal"]'}


def fresh(kind: str) -> Lark:
    """A parser as it is built in a new process."""
    return reading._parser.__wrapped__(kind)


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr("platformdirs.user_cache_path", lambda _: tmp_path / "cache")
    return tmp_path / "cache"


@pytest.mark.parametrize("kind", GRAMMARS)
def test_no_text_can_be_read_in_two_ways(
    kind: str, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(logger, "level", logging.DEBUG)
    monkeypatch.setattr(logger, "handlers", [caplog.handler])
    Lark.open_from_package("ratherthan.model", f"{kind}.lark", parser="lalr", debug=True)
    assert [record for record in caplog.records if "conflict" in record.getMessage().lower()] == []


def test_an_ambiguous_grammar_would_be_found(caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(logger, "level", logging.DEBUG)
    monkeypatch.setattr(logger, "handlers", [caplog.handler])
    Lark('start: "a" | start "+" start', parser="lalr", debug=True)
    assert any("conflict" in record.getMessage().lower() for record in caplog.records)


def test_the_grammar_names_exactly_the_refusals_of_the_table() -> None:
    named = {rule.alias for rule in fresh("property").rules if rule.origin.name.startswith("no_")}
    assert named == set(REFUSED) - {"total"}  # the property itself tells whether a sum without end is discounted


@pytest.mark.parametrize("kind", GRAMMARS)
def test_tables_from_the_cache_read_the_same(kind: str, cache: Path) -> None:
    built = fresh(kind)
    (kept,) = cache.rglob(f"{kind}*")
    before = kept.read_bytes()
    loaded = fresh(kind)
    assert loaded.source_path == "<deserialized>" != built.source_path
    assert kept.read_bytes() == before
    assert loaded.parse(TEXTS[kind]) == built.parse(TEXTS[kind])


@pytest.mark.parametrize("kind", GRAMMARS)
@pytest.mark.parametrize("content", [b"", b"junk", b"junk\nmore"])
def test_a_damaged_cache_is_built_anew(kind: str, content: bytes, cache: Path) -> None:
    wanted = fresh(kind).parse(TEXTS[kind])
    (kept,) = cache.rglob(f"{kind}*")
    whole = kept.read_bytes()
    for damaged in (content, whole[: len(whole) // 2]):
        kept.write_bytes(damaged)
        assert fresh(kind).parse(TEXTS[kind]) == wanted
        assert fresh(kind).source_path == "<deserialized>"


def test_where_nothing_can_be_kept_everything_is_read_all_the_same(cache: Path, capfd: pytest.CaptureFixture) -> None:
    wanted = Term("label", value="goal")
    cache.mkdir()
    (cache / "grammars").touch()
    assert reading._kept("formula") is False
    assert fresh("formula").parse('"goal"') == wanted
    (cache / "grammars").unlink()
    Path(str(reading._kept("formula"))).mkdir(parents=True)
    assert fresh("formula").parse('"goal"') == wanted
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("kind", GRAMMARS)
def test_what_is_nested_too_deeply_is_refused_at_once(kind: str) -> None:
    for inner in ("(" * 100_000 + "x" + ")" * 100_000, "!" * 100_000 + "x", "-" * 100_000, "x ? 1 : " * 100_000):
        text = inner if kind == "formula" else f"Pmax=? [F {inner}]"
        with pytest.raises(PropertyError, match="nested too deeply to be read"):
            reading.read(kind, text, kind)


def test_brackets_that_people_write_are_read() -> None:
    text = "(" * 500 + "x" + ")" * 500
    assert text_of(reading.read("formula", text, "formula")) == "x"
