"""A file, a name or an object enters, a Problem leaves; and back: the one room that knows formats."""

from ratherthan.io._files import Limits
from ratherthan.io.policies import read_policy
from ratherthan.io.read import read, write

__all__ = ["Limits", "read", "read_policy", "write"]
