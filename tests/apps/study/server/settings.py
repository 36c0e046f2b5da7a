"""A folder enters, a study that is through in a few requests leaves; and a new database of a PostgreSQL server."""

from __future__ import annotations

import secrets
from dataclasses import replace
from pathlib import Path
from typing import Any

from apps.study.designs import small_design

from ratherthan.apps.study.design.nouns import Design

KINDS = ("none", "naive-path", "contrastive")


def little(folder: Path, **changes: Any) -> Design:
    """Return a design of one map and three kinds, with six orders."""
    folder.mkdir(exist_ok=True, parents=True)
    made = small_design(folder, maps=1, kinds=KINDS, quota=12)
    groupings = tuple(one for one in made.groupings if set(one.kinds) <= set(KINDS))
    attention = tuple(replace(check, after=min(check.after, 2)) for check in made.attention[:1])
    return replace(made, groupings=groupings, attention=attention, **changes)


def new_database(url: str) -> str:
    """Return the address of a new database of a server."""
    import psycopg

    name = f"study_{secrets.token_hex(6)}"
    with psycopg.connect(url, autocommit=True) as connection:
        connection.execute(f"CREATE DATABASE {name}")
    return f"{url.rpartition('/')[0]}/{name}"
