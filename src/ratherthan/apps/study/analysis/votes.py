"""What is known of choices enters, the tables of it leave."""

from __future__ import annotations

from ratherthan.apps.study.analysis.data import Data
from ratherthan.apps.study.analysis.document import Table
from ratherthan.apps.study.analysis.listing import DASH, Cells, cell_p, head_of, span
from ratherthan.apps.study.analysis.pictures import published_of
from ratherthan.apps.study.analysis.preferred import corrected_tests, option_label
from ratherthan.apps.study.analysis.preferring import GroupResult, Lacking, Preferences
from ratherthan.apps.study.analysis.words import listed, number, percent, say

__all__ = ["choice_tables"]


def choice_tables(data: Data, found: Preferences) -> list[Table]:
    """Return the shares of each grouping, their tests, and the ranking."""
    tables = [
        Table(
            caption=say("captions.shares", name=listed([option_label(data, kind) for kind in group.kinds])),
            head=head_of("choice", "votes", "share", "interval", "published"),
            rows=_share_rows(data, group),
        )
        for group in found.groups
    ]
    rows = [
        row for group, p in zip(found.groups, corrected_tests(found), strict=True) for row in _test_rows(data, group, p)
    ]
    tables.append(
        Table(
            caption=say("captions.choice_tests"),
            head=head_of("comparison", "test", "statistic", "p", "holm"),
            rows=tuple(rows),
            words=2,
        )
    )
    ranking = found.ranking
    if not isinstance(ranking, Lacking):
        order = sorted(range(len(ranking.items)), key=lambda i: -ranking.worth[i])
        ranked = tuple(
            (
                option_label(data, found.kinds[ranking.items[i]]),
                number(ranking.worth[i], 3),
                span(ranking.low[i], ranking.high[i], 3),
                DASH
                if ranking.rank_low[i] is None
                else say("forms.span", low=ranking.rank_low[i], high=ranking.rank_high[i]),
            )
            for i in order
        )
        tables.append(
            Table(caption=say("captions.ranking"), head=head_of("kind", "worth", "interval", "ranks"), rows=ranked)
        )
    return tables


def _share_rows(data: Data, group: GroupResult) -> tuple[Cells, ...]:
    if isinstance(group.shares, Lacking):
        return ((say("forms.not_computed", why=group.shares.why), DASH, DASH, DASH, DASH),)
    return tuple(
        (
            option_label(data, option),
            str(share.votes),
            percent(share.share, 1),
            say("forms.span", low=percent(share.low, 1), high=percent(share.high, 1)),
            percent(published_of(data, group, option), 1),
        )
        for option, share in zip(group.options, group.shares, strict=True)
    )


def _test_rows(data: Data, group: GroupResult, corrected: float | None) -> list[Cells]:
    """Return the tests of persons and of votes of one grouping."""
    name = listed([option_label(data, kind) for kind in group.kinds])
    pair = len(group.kinds) == 2
    rows: list[Cells] = []
    for key, test, holm in (
        ("sign" if pair else "hotelling", group.of_persons, cell_p(corrected)),
        ("binomial" if pair else "chi", group.of_votes, DASH),
    ):
        if isinstance(test, Lacking):
            rows.append((name, say(f"tests.{key}"), say("forms.not_computed", why=test.why), DASH, DASH))
            continue
        freedom = (*test.freedom, 0, 0)
        value = say(
            f"tests.{key}_value",
            first=int(test.statistic),
            count=test.count,
            freedom=freedom[0],
            one=freedom[0],
            other=freedom[1],
            statistic=number(test.statistic),
        )
        rows.append((name, say(f"tests.{key}"), value, cell_p(test.p), holm))
    return rows
