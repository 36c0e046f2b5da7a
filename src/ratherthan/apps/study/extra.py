"""Nothing enters; a sentence leaves, where the libraries of the study are not installed."""

from __future__ import annotations

from importlib.util import find_spec

from ratherthan.errors import MissingExtraError

__all__ = ["NEEDED", "require_study"]

NEEDED = ("sqlalchemy", "alembic", "starlette", "uvicorn", "jinja2", "itsdangerous", "argon2", "pyarrow")


def require_study() -> None:
    """Refuse to go on without the libraries of the study.

    Raises
    ------
    MissingExtraError
        With what is to be installed.
    """
    missing = [name for name in NEEDED if find_spec(name) is None]
    if missing:
        raise MissingExtraError(
            f"A study needs libraries that are not installed ({', '.join(missing)}): pip install 'ratherthan[study]'."
        )
