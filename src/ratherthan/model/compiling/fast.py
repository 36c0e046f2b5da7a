"""A kernel enters, the function that runs it as machine code leaves: kept, shipped or made when it first meets its arguments."""

from __future__ import annotations

import inspect
import threading
import time
from collections.abc import Callable
from typing import Any

from ratherthan.model.compiling import AFTER, tally
from ratherthan.model.compiling._kernels import code_of, machine, plain, text_by_numba
from ratherthan.model.compiling.calling import Code, arrays_of
from ratherthan.model.compiling.shipped import Made, text_of_shipped
from ratherthan.model.compiling.signature import UnusualError, described, taken
from ratherthan.model.compiling.source import is_current, name_of, text_of, written
from ratherthan.model.compiling.store import digest, keep, kept
from ratherthan.model.watch import look

__all__ = ["Fast", "digest_of"]

FORM = "1"
"""Changes where machine code that was kept is called in another way."""
_one_at_a_time = threading.RLock()


class Fast:
    """A kernel, compiled for the types of arguments that it has met."""

    def __init__(self, kernel: Callable[..., Any]) -> None:
        self.__name__ = kernel.__name__
        self.__doc__ = kernel.__doc__
        self.__wrapped__ = kernel
        self._codes: dict[tuple[Any, ...], Any] = {}
        self._written: tuple[int, ...] | None = None

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        """Run the kernel."""
        if named:
            bound = inspect.signature(self.__wrapped__).bind(*arguments, **named)
            bound.apply_defaults()
            arguments = bound.args
        try:
            types, numbers = taken(arguments)
        except UnusualError as reason:
            return self._plain(str(reason))(*arguments)
        code = self._codes.get(types)
        if code is None:
            code = self._made(types, numbers)
        if isinstance(code, str):
            return self._plain(code)(*arguments)
        if self._locked(arguments):
            return self._plain("an array that is locked")(*arguments)
        return code(arguments, numbers)

    def _made(self, types: tuple[Any, ...], numbers: list[int | float]) -> Any:
        """Return the machine code for arguments of these types, or why numba must do it alone."""
        with _one_at_a_time:
            if types not in self._codes:
                try:
                    self._codes[types] = _code(self.__wrapped__, types, numbers)
                except UnusualError as reason:
                    self._codes[types] = str(reason)
            return self._codes[types]

    def _locked(self, arguments: tuple[Any, ...]) -> bool:
        """Whether an array that the kernel may write to must not be written to: numba then says which."""
        if self._written is None:
            self._written = tuple(sorted(written(self.__wrapped__)))
        meant = [arguments[i] for i in self._written if i < len(arguments)]
        return any(not array.flags.writeable for array in arrays_of(meant))

    def _plain(self, reason: str) -> Callable[..., Any]:
        """Return the kernel compiled by numba alone."""
        with _one_at_a_time:
            tally.plain.setdefault(self.__name__, reason)
            return plain(self.__wrapped__)


def digest_of(kernel: Callable[..., Any], types: str) -> str:
    """Return the digest of a kernel's text for arguments of some types."""
    return digest(FORM, text_of(kernel), types)


def _code(kernel: Callable[..., Any], types: tuple[Any, ...], numbers: list[int | float]) -> Any:
    """Return machine code: kept, shipped or made."""
    own = digest_of(kernel, described(types))
    name = f"{name_of(kernel)}-{digest(own, *machine())}"
    known = None if tally.texts is not None else kept(name)
    if known is not None:
        tally.kept.append(kernel.__name__)
        return Code(known[1], types, known[0]["result"], numbers)
    if not is_current(kernel):
        raise UnusualError("a file that has changed since it was loaded")
    began = time.perf_counter()
    text, head = _text(kernel, types, f"{name_of(kernel)}-{own}")
    result = head["result"]
    code = code_of(text, types, result)
    ready = Code(code, types, result, numbers)
    keep(name, head, code)
    _took(time.perf_counter() - began)
    return ready


def _text(kernel: Callable[..., Any], types: tuple[Any, ...], name: str) -> Made:
    """Return LLVM's text of a kernel and its head, as it is shipped or as numba makes it."""
    shipped = text_of_shipped(name) if tally.texts is None else None
    if shipped is not None:
        tally.shipped.append(kernel.__name__)
        return shipped
    look(f"compiling {kernel.__name__}, once on this machine")
    text, result = text_by_numba(kernel, types)
    made = (
        text,
        {
            "kernel": f"{kernel.__module__}:{kernel.__qualname__}",
            "types": described(types),
            "result": result,
        },
    )
    tally.compiled.append(f"{kernel.__name__}({described(types)})")
    if tally.texts is not None:
        tally.texts[name] = made
    return made


def _took(seconds: float) -> None:
    """Count what compiling took, and say a word when it is much."""
    tally.seconds += seconds
    if tally.seconds > AFTER and tally.announce is not None:
        announce, tally.announce = tally.announce, None
        announce(
            "Some loops are compiled for this machine, which takes some seconds and is needed once; "
            "'ratherthan warmup' does it ahead of time."
        )
