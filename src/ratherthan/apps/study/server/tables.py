"""What a study stores, as tables: nothing enters, `METADATA` leaves.

Times are milliseconds since 1970 in UTC. What a platform calls a person lies in `IDENTITY` alone, apart from the answers, and goes with
the participant. Answers and attempts hang on a participant: who is erased takes all of it along.
"""

from __future__ import annotations

from sqlalchemy import (
    BigInteger,
    Boolean,
    Column,
    ForeignKey,
    Index,
    Integer,
    MetaData,
    Table,
    Text,
)

__all__ = ["ANSWER", "ATTEMPT", "IDENTITY", "METADATA", "PARTICIPANT", "PLACE", "SERVED", "STUDY", "TOMBSTONE"]

METADATA = MetaData(
    naming_convention={
        "ix": "ix_%(table_name)s_%(column_0_name)s",
        "uq": "uq_%(table_name)s_%(column_0_name)s",
        "fk": "fk_%(table_name)s_%(column_0_name)s",
        "pk": "pk_%(table_name)s",
    }
)

STUDY = Table(
    "study",
    METADATA,
    Column("id", Integer, primary_key=True, autoincrement=False),  # 1: there is one
    Column("fingerprint", Text, nullable=False),  # of the design
    Column("simulated", Boolean, nullable=False),
    Column("secret", Text, nullable=False),  # signs tokens and cookies
    Column("password", Text, nullable=False),  # argon2 hash
    Column("paused", Boolean, nullable=False),
    Column("quota", Integer),  # how many may finish; None: any number
    Column("next_slot", Integer, nullable=False),  # the counter: slots below it have a row in `place`
    Column(
        "entered", Integer, nullable=False
    ),  # how many ever entered, erased ones too; its row is the lock of assigning
    Column("created", BigInteger, nullable=False),
)

SERVED = Table(  # apart from `study`, whose row is written anew for everybody who enters
    "served",
    METADATA,
    Column("id", Integer, primary_key=True, autoincrement=False),  # 1: there is one
    Column("design", Text, nullable=False),  # all of it as JSON: an export needs nothing but the database
)

PARTICIPANT = Table(
    "participant",
    METADATA,
    Column("id", Integer, primary_key=True),
    Column("number", Integer, nullable=False, unique=True),  # drawn by lot; exports and researchers call them by it
    Column("key", Text, nullable=False, unique=True),  # what a token carries
    Column("code", Text, nullable=False, unique=True),  # to withdraw with
    Column("platform", Text, nullable=False),
    Column("state", Text, nullable=False),
    Column("slot", Integer),  # None before consent
    Column("answered", Integer, nullable=False),  # screens done: the index of the present one
    Column("tries", Integer, nullable=False),  # failed tries of the comprehension check
    Column("failed", Integer, nullable=False),  # failed attention checks
    Column("repeated", Boolean, nullable=False),  # the platform's person had taken part before
    Column("entered", BigInteger, nullable=False),
    Column("seen", BigInteger, nullable=False),
    Column("ended", BigInteger),
    Index("ix_participant_state", "state", "seen"),
)

IDENTITY = Table(
    "identity",
    METADATA,
    Column("participant", Integer, ForeignKey("participant.id", ondelete="CASCADE"), primary_key=True),
    Column("session", Text, unique=True),  # platform and its session: who comes with it again is the same participant
    Column("person", Text, index=True),
    Column("study", Text),
    Column("submit_to", Text),
)

PLACE = Table(
    "place",
    METADATA,
    Column("slot", Integer, primary_key=True, autoincrement=False),
    Column("holder", Integer, ForeignKey("participant.id", ondelete="SET NULL"), unique=True),  # None: free
)

ATTEMPT = Table(
    "attempt",
    METADATA,
    Column("participant", Integer, ForeignKey("participant.id", ondelete="CASCADE"), primary_key=True),
    Column("screen", Text, primary_key=True),
    Column("number", Integer, primary_key=True),
    Column("opened", BigInteger, nullable=False),
    Column("visible", BigInteger, nullable=False),  # ms in which the page was seen
    Column("hidden", BigInteger, nullable=False),  # ms in which its tab was not
)

ANSWER = Table(
    "answer",
    METADATA,
    Column("participant", Integer, ForeignKey("participant.id", ondelete="CASCADE"), primary_key=True),
    Column("screen", Text, primary_key=True),
    Column("turn", Integer, primary_key=True),  # the comprehension check may be answered several times
    Column("attempt", Integer, nullable=False),
    Column("place", Integer, nullable=False),  # of the screen in the participant's list, from 1
    Column("content", Text, nullable=False),  # JSON: name of the record to value
    Column("stored", BigInteger, nullable=False),
)

TOMBSTONE = Table(
    "tombstone",
    METADATA,
    Column("id", Integer, primary_key=True),
    Column("day", Text, nullable=False),  # on which somebody was erased, and nothing else
)
