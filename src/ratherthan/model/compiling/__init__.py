"""A kernel and the work that it will do enter; the kernel as it stands leaves, or compiled.

A *kernel* is a plain function over arrays. For little work it runs as it stands, and nothing is loaded. For much work it runs as
machine code, and the first of these ways to it that is open is taken:

1. it was made before, on this machine, and is kept: it is loaded (milliseconds, and a tenth of a second for LLVM once);
2. LLVM's text of the kernel travels with the package: it becomes machine code, which is kept (hundredths of a second);
3. numba turns the kernel into LLVM's text (a second to load numba, then up to two for a kernel), and on as in 2;
4. numba alone: on machines, for arguments and for results that the short way does not know.

All four compute the same. Kernels are told apart by their own text and that of what they refer to, by the types of their arguments,
the processor and the compiler's version, so that nothing out of date is ever run.
``RATHERTHAN_COMPILE`` is ``auto`` (default), ``always`` or ``never``, or ``numba``: always, and only by way 4;
``NUMBA_DISABLE_JIT=1`` means never, too.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from typing import Any, ParamSpec, TypeVar

__all__ = ["LEAST_WORK", "Tally", "compiled", "is_compiled", "tally"]

P = ParamSpec("P")
R = TypeVar("R")

LEAST_WORK = 15_000
"""From how many branches on a kernel is compiled; below, the plain loop is faster than loading compiled code."""


@dataclass(kw_only=True)
class Tally:
    """How the machine code of this process came to be.

    Parameters
    ----------
    kept, shipped, compiled : list of str
        The kernels that were loaded, made from what is shipped, and made by numba.
    plain : dict of str
        Those that were left to numba alone, and why.
    texts : dict, optional
        Where given, everything is made by numba, and its texts are put there.
    seconds : float
        Spent on making machine code.
    announce : callable, optional
        Is told once when that takes longer than `AFTER`.
    """

    kept: list[str] = field(default_factory=list)
    shipped: list[str] = field(default_factory=list)
    compiled: list[str] = field(default_factory=list)
    plain: dict[str, str] = field(default_factory=dict)
    texts: dict[str, Any] | None = None
    seconds: float = 0.0
    announce: Callable[[str], None] | None = None


tally = Tally()
AFTER = 1.0
"""Seconds of compiling after which a word is said."""


def compiled(kernel: Callable[P, R], work: int) -> Callable[P, R]:
    """Return `kernel`, compiled if `work` (about the number of branches) is worth it."""
    if not is_compiled(work):
        return kernel
    return _fast(kernel, alone=os.environ.get("RATHERTHAN_COMPILE") == "numba")


def is_compiled(work: int) -> bool:
    """Return whether kernels are compiled for that much work."""
    wish = os.environ.get("RATHERTHAN_COMPILE", "auto")
    if wish == "never" or os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0"):
        return False
    return wish in ("always", "numba") or work >= LEAST_WORK


@cache
def _fast(kernel: Callable[..., Any], *, alone: bool) -> Callable[..., Any]:
    """Return the one compiled form of a kernel, or numba's own."""
    if alone:
        from ratherthan.model.compiling._kernels import plain

        return plain(kernel)
    from ratherthan.model.compiling.fast import Fast

    return Fast(kernel)
