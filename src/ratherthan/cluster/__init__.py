"""A table of missions, or a model that no machine holds, enters; explanations and values leave, computed by many workers.

Two jobs are too much for one process. *Many at once* (`explain_many`): a table of missions becomes a table of explanations; the
rows of one model share its reading and its solving. *One that is too large* (`solve_in_blocks`): the rows of one archive are read
in blocks, each by the worker that solves it; what they exchange is small, and one sweep over all of them proves the bounds.

The engine that starts workers, schedules work and recovers from lost ones is Dask's ``distributed`` (`engine`, the only module that
knows it). It is optional: without it one process does the first job.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ratherthan.cluster.asking import ask, route_of
    from ratherthan.cluster.batch import explain_many
    from ratherthan.cluster.blocks import Blocks, Blockwise
    from ratherthan.cluster.blockwise import solve_in_blocks, solved_in_blocks

_HOMES = {
    "Blocks": "blocks",
    "Blockwise": "blocks",
    "ask": "asking",
    "explain_many": "batch",
    "route_of": "asking",
    "solve_in_blocks": "blockwise",
    "solved_in_blocks": "blockwise",
}
__all__ = ["Blocks", "Blockwise", "ask", "explain_many", "route_of", "solve_in_blocks", "solved_in_blocks"]


def __getattr__(name: str) -> Any:
    """Load a job when it is asked for."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
