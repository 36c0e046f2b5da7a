"""A connection in Alembic's settings enters; the migrations are run on it, in its transaction."""

from __future__ import annotations

from alembic import context

from ratherthan.apps.study.server.tables import METADATA

context.configure(
    connection=context.config.attributes["connection"],
    target_metadata=METADATA,
    render_as_batch=True,
    compare_type=True,
)
context.run_migrations()
