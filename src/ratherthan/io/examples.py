"""The name of an example enters, a Problem leaves: small models that come with the package, as text files.

An example is a file in the folder ``example_data``: a road map, or a table of states. A file laid there is an example.
"""

from __future__ import annotations

from importlib.resources import files
from typing import TYPE_CHECKING

from ratherthan.errors import SourceError
from ratherthan.io._roadmap_text import closest

if TYPE_CHECKING:
    from ratherthan.model.problem import Problem

__all__ = ["example_names", "read_example"]

SUFFIXES = (".roadmap", ".states")


def example_names() -> tuple[str, ...]:
    """Return the names of the examples, sorted.

    Returns
    -------
    tuple of str

    Examples
    --------
    >>> "paper-5x5" in example_names()
    True
    """
    return tuple(sorted(_example_files()))


def read_example(name: str) -> Problem:
    """Read an example.

    Parameters
    ----------
    name : str
        One of `example_names`.

    Returns
    -------
    Problem

    Raises
    ------
    SourceError
        If there is no such example; it lists those there are.

    Examples
    --------
    >>> read_example("paper-5x5").mdp
    MDP(25 states, 31 choices, 56 branches; labels: destination; rewards: distance)
    """
    known = _example_files()
    if name not in known:
        raise SourceError(
            f"An example must be one of {', '.join(sorted(known))}; got '{name}'.{closest(name, known)}", example=name
        )
    text = (files("ratherthan.io") / "example_data" / known[name]).read_text(encoding="utf-8")
    source = f"example:{name}"
    if known[name].endswith(".roadmap"):
        from ratherthan.io.roadmap import parse_roadmap

        return parse_roadmap(text, source=source)
    from ratherthan.io._state_table import parse_state_table

    return parse_state_table(text, source=source)


def _example_files() -> dict[str, str]:
    """Return the file of each example by its name."""
    found = (entry.name for entry in (files("ratherthan.io") / "example_data").iterdir())
    return {name.rpartition(".")[0]: name for name in found if name.endswith(SUFFIXES)}
