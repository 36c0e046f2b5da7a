"""A secret and a name enter, a token leaves that nobody else can make; and back."""

from __future__ import annotations

import hashlib
import secrets

from itsdangerous import BadSignature, Signer, TimestampSigner

__all__ = [
    "code_of",
    "csrf_of",
    "new_code",
    "new_key",
    "new_password",
    "new_secret",
    "read",
    "read_dated",
    "signed",
    "signed_dated",
]

LETTERS = "23456789abcdefghjkmnpqrstuvwxyz"
"""Those that are not taken for another when they are copied by hand."""
LONGEST = 400


def new_secret() -> str:
    """Return a secret to sign with."""
    return secrets.token_hex(32)


def new_key() -> str:
    """Return a name that cannot be guessed."""
    return secrets.token_hex(16)


def new_code() -> str:
    """Return a code to withdraw with: 12 letters, about 59 bits."""
    return _grouped(12)


def new_password() -> str:
    """Return a password: 16 letters, about 79 bits."""
    return _grouped(16)


def code_of(text: str) -> str:
    """Return a code as it is stored, however it was typed.

    Examples
    --------
    >>> code_of(" K7QM 2xwd-9prt ")
    'k7qm-2xwd-9prt'
    """
    letters = [mark for mark in text.lower() if mark in LETTERS]
    return "-".join("".join(letters[start : start + 4]) for start in range(0, len(letters), 4))


def signed(secret: str, salt: str, name: str) -> str:
    """Return a name with its signature."""
    return Signer(secret, salt=salt, digest_method=hashlib.sha256).sign(name).decode()


def read(secret: str, salt: str, token: str) -> str | None:
    """Return the name in a token, None where its signature is not ours."""
    if len(token) > LONGEST or not token.isascii():
        return None
    try:
        return Signer(secret, salt=salt, digest_method=hashlib.sha256).unsign(token).decode()
    except (BadSignature, UnicodeDecodeError):
        return None


def signed_dated(secret: str, salt: str, name: str) -> str:
    """Return a name with its signature and the time."""
    return TimestampSigner(secret, salt=salt, digest_method=hashlib.sha256).sign(name).decode()


def read_dated(secret: str, salt: str, token: str, *, age: int) -> str | None:
    """Return the name in a token that is at most `age` seconds old, else None."""
    if len(token) > LONGEST or not token.isascii():
        return None
    try:
        return TimestampSigner(secret, salt=salt, digest_method=hashlib.sha256).unsign(token, max_age=age).decode()
    except (BadSignature, UnicodeDecodeError):
        return None


def csrf_of(secret: str, session: str) -> str:
    """Return what a form must carry that belongs to a session."""
    return signed(secret, "form", hashlib.sha256(session.encode()).hexdigest()[:32])


def _grouped(count: int) -> str:
    return code_of("".join(secrets.choice(LETTERS) for _ in range(count)))
