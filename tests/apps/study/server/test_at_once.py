"""Many people answer in the same moment: everybody gets the next page, and every answer is stored."""

from __future__ import annotations

import asyncio
from collections import Counter

import pytest
from apps.study.designs import small_design
from apps.study.server.visitors import right_answers
from sqlalchemy import select

from benchmarks import study as benchmark
from ratherthan.apps.study.server.researchers import entrance
from ratherthan.apps.study.server.tables import ANSWER, PLACE

PEOPLE, PAGES = 60, 8


@pytest.mark.slow
def test_everybody_who_answers_at_once_is_answered(tmp_path, database, served, monkeypatch):
    monkeypatch.setattr(benchmark, "PEOPLE", PEOPLE)
    monkeypatch.setattr(benchmark, "PAGES", PAGES)
    study, address = served(small_design(tmp_path, quota=PEOPLE), database)
    right = right_answers(study.design)
    waited = asyncio.run(benchmark.visits(address, entrance(study.secret, address), right, at_once=True))
    assert len(waited) == PEOPLE * PAGES  # `visits` raises where anything but an answer came
    kept = study.store.read(lambda connection: connection.execute(select(ANSWER.c.participant)).scalars().all())
    assert set(Counter(kept).values()) == {PAGES}
    places = study.store.read(lambda connection: connection.execute(select(PLACE)).all())
    assert sorted(place.slot for place in places) == list(range(PEOPLE))
