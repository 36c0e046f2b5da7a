"""The first tables."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0001"
down_revision = None
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Make all tables."""
    op.create_table(
        "study",
        sa.Column("id", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("fingerprint", sa.Text(), nullable=False),
        sa.Column("simulated", sa.Boolean(), nullable=False),
        sa.Column("secret", sa.Text(), nullable=False),
        sa.Column("password", sa.Text(), nullable=False),
        sa.Column("paused", sa.Boolean(), nullable=False),
        sa.Column("quota", sa.Integer()),
        sa.Column("next_slot", sa.Integer(), nullable=False),
        sa.Column("entered", sa.Integer(), nullable=False),
        sa.Column("created", sa.BigInteger(), nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_study"),
    )
    op.create_table(
        "served",
        sa.Column("id", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("design", sa.Text(), nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_served"),
    )
    op.create_table(
        "participant",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("number", sa.Integer(), nullable=False),
        sa.Column("key", sa.Text(), nullable=False),
        sa.Column("code", sa.Text(), nullable=False),
        sa.Column("platform", sa.Text(), nullable=False),
        sa.Column("state", sa.Text(), nullable=False),
        sa.Column("slot", sa.Integer()),
        sa.Column("answered", sa.Integer(), nullable=False),
        sa.Column("tries", sa.Integer(), nullable=False),
        sa.Column("failed", sa.Integer(), nullable=False),
        sa.Column("repeated", sa.Boolean(), nullable=False),
        sa.Column("entered", sa.BigInteger(), nullable=False),
        sa.Column("seen", sa.BigInteger(), nullable=False),
        sa.Column("ended", sa.BigInteger()),
        sa.PrimaryKeyConstraint("id", name="pk_participant"),
        sa.UniqueConstraint("number", name="uq_participant_number"),
        sa.UniqueConstraint("key", name="uq_participant_key"),
        sa.UniqueConstraint("code", name="uq_participant_code"),
    )
    op.create_index("ix_participant_state", "participant", ["state", "seen"])
    _of_participants()
    op.create_table(
        "tombstone",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("day", sa.Text(), nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_tombstone"),
    )


def downgrade() -> None:
    """Remove all tables."""
    for table in ("tombstone", "answer", "attempt", "place", "identity", "participant", "served", "study"):
        op.drop_table(table)


def _of_participants() -> None:
    """Make the tables whose rows hang on a participant."""
    op.create_table(
        "identity",
        sa.Column("participant", sa.Integer(), nullable=False),
        sa.Column("session", sa.Text()),
        sa.Column("person", sa.Text()),
        sa.Column("study", sa.Text()),
        sa.Column("submit_to", sa.Text()),
        sa.PrimaryKeyConstraint("participant", name="pk_identity"),
        sa.UniqueConstraint("session", name="uq_identity_session"),
        _belongs("identity", "participant", "CASCADE"),
    )
    op.create_index("ix_identity_person", "identity", ["person"])
    op.create_table(
        "place",
        sa.Column("slot", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("holder", sa.Integer()),
        sa.PrimaryKeyConstraint("slot", name="pk_place"),
        sa.UniqueConstraint("holder", name="uq_place_holder"),
        _belongs("place", "holder", "SET NULL"),
    )
    op.create_table(
        "attempt",
        sa.Column("participant", sa.Integer(), nullable=False),
        sa.Column("screen", sa.Text(), nullable=False),
        sa.Column("number", sa.Integer(), nullable=False),
        sa.Column("opened", sa.BigInteger(), nullable=False),
        sa.Column("visible", sa.BigInteger(), nullable=False),
        sa.Column("hidden", sa.BigInteger(), nullable=False),
        sa.PrimaryKeyConstraint("participant", "screen", "number", name="pk_attempt"),
        _belongs("attempt", "participant", "CASCADE"),
    )
    op.create_table(
        "answer",
        sa.Column("participant", sa.Integer(), nullable=False),
        sa.Column("screen", sa.Text(), nullable=False),
        sa.Column("turn", sa.Integer(), nullable=False),
        sa.Column("attempt", sa.Integer(), nullable=False),
        sa.Column("place", sa.Integer(), nullable=False),
        sa.Column("content", sa.Text(), nullable=False),
        sa.Column("stored", sa.BigInteger(), nullable=False),
        sa.PrimaryKeyConstraint("participant", "screen", "turn", name="pk_answer"),
        _belongs("answer", "participant", "CASCADE"),
    )


def _belongs(table: str, column: str, deleted: str) -> sa.ForeignKeyConstraint:
    return sa.ForeignKeyConstraint([column], ["participant.id"], name=f"fk_{table}_{column}", ondelete=deleted)
