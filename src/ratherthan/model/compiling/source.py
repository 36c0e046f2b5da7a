"""A kernel enters; the text that decides what machine code it becomes leaves, and which of its arguments it writes to.

Machine code is kept under the text of its kernel and of all that the kernel refers to, not under the file that holds it or the
file's time: a kernel is compiled again when it has changed, and not because its neighbour has.
"""

from __future__ import annotations

import ast
import builtins
import linecache
import marshal
import textwrap
import types
from collections.abc import Callable
from functools import cache
from typing import Any

__all__ = ["is_current", "name_of", "text_of", "written"]

WRITERS = frozenset(
    (
        "at",
        "copyto",
        "fill",
        "fill_diagonal",
        "partition",
        "place",
        "put",
        "put_along_axis",
        "putmask",
        "shuffle",
        "sort",
    )
)
"""Functions of numpy and methods of arrays that write to what they are given."""
PLAIN = (bool, int, float, str, bytes, tuple, type(None))


def name_of(kernel: Callable[..., Any]) -> str:
    """Return a name for the files that keep a kernel.

    Examples
    --------
    >>> from ratherthan.solve._kernels import sweep
    >>> name_of(sweep)
    'solve.sweep'
    """
    room = kernel.__module__.removeprefix("ratherthan.").removesuffix("._kernels")
    kept = "".join(c if c.isalnum() or c in "._" else "-" for c in f"{room}.{kernel.__name__}")
    return kept[-100:]


@cache
def text_of(kernel: Callable[..., Any]) -> str:
    """Return the text of a kernel and of what it refers to."""
    return "\n".join(_texts(kernel, set()))


def is_current(kernel: Callable[..., Any]) -> bool:
    """Return whether the text is that of the kernel as it was loaded: a file may have changed since."""
    code = kernel.__code__
    text = "".join(linecache.getlines(code.co_filename))
    if not text:
        return True  # there is no text: it goes by its code
    try:
        waiting = [compile(text, code.co_filename, "exec", dont_inherit=True)]
    except SyntaxError:
        return False
    while waiting:
        parts = [part for part in waiting.pop().co_consts if isinstance(part, types.CodeType)]
        if any(part.co_firstlineno == code.co_firstlineno and _essence(part) == _essence(code) for part in parts):
            return True
        waiting += parts
    return False


def _essence(code: types.CodeType) -> tuple[object, ...]:
    """Return what a function does."""
    inner = tuple(_essence(part) if isinstance(part, types.CodeType) else part for part in code.co_consts)
    return code.co_name, code.co_varnames, code.co_names, code.co_code, inner


def _texts(kernel: Callable[..., Any], seen: set[object]) -> list[str]:
    """Return the text of a function, then those of the names that it takes from around it."""
    seen.add(kernel)
    code = kernel.__code__
    texts = [_own_text(code)]
    around = kernel.__globals__ | {
        name: cell.cell_contents for name, cell in zip(code.co_freevars, kernel.__closure__ or (), strict=True)
    }
    for name in sorted({*_names(code), *code.co_freevars}):
        if name not in around:
            continue
        value = around[name]
        if isinstance(value, types.FunctionType):
            if value not in seen:
                texts += _texts(value, seen)
        elif isinstance(value, PLAIN):
            texts.append(f"{name} = {value!r}")
        elif isinstance(value, type):
            texts.append(f"{name} = {value.__module__}.{value.__qualname__}{getattr(value, '_fields', '')}")
        else:
            texts.append(f"{name}: {type(value).__qualname__} {getattr(value, '__name__', '')}")
    return texts


def _names(code: types.CodeType) -> set[str]:
    """Return the names that a function and those inside it look up."""
    names = set(code.co_names)
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            names |= _names(constant)
    return names


def _own_text(code: types.CodeType) -> str:
    """Return the lines of a function: from its first to the next one that stands at the same depth and closes nothing."""
    lines = linecache.getlines(code.co_filename)[code.co_firstlineno - 1 :]
    if not lines:
        return marshal.dumps(code).hex()
    depth = len(lines[0]) - len(lines[0].lstrip())
    for i, line in enumerate(lines):
        begun = line.strip()
        if i > 0 and begun and len(line) - len(line.lstrip()) <= depth and begun[0] not in ")]}#":
            lines = lines[:i]
            break
    return "".join(lines).rstrip()


@cache
def written(kernel: Callable[..., Any]) -> frozenset[int]:
    """Return which parameters a kernel may write to, by place; all of them where its text cannot be had.

    A parameter is written to where something with a subscript is assigned to and goes by its name, or by a name that was given
    to it or a part of it.
    """
    parameters = kernel.__code__.co_varnames[: kernel.__code__.co_argcount]
    try:
        tree = ast.parse(textwrap.dedent(_own_text(kernel.__code__)))
    except SyntaxError:
        return frozenset(range(len(parameters)))
    origins: dict[str, set[str]] = {name: {name} for name in parameters}
    found: set[str] = set()
    nodes = list(ast.walk(tree))
    for _ in range(3):  # a name for a name for a name
        for node in nodes:
            if isinstance(node, ast.Assign):
                given = _roots(node.value)
                for target in node.targets:
                    for name in _bound(target):
                        origins.setdefault(name, set()).update(*(origins.get(root, set()) for root in given))
    for node in nodes:
        if isinstance(node, ast.Subscript) and isinstance(node.ctx, ast.Store):
            found |= _roots(node.value)
        elif isinstance(node, ast.Call):
            found |= _given_away(node)
    names = set().union(*(origins.get(name, set()) for name in found)) if found else set()
    return frozenset(i for i, name in enumerate(parameters) if name in names)


def _given_away(call: ast.Call) -> set[str]:
    """Return the names of what a call may write to: a function of ours to all that it is given, an array's method to the array."""
    given = {root for part in call.args for root in _roots(part)}
    given |= {root for part in call.keywords for root in _roots(part.value)}
    if isinstance(call.func, ast.Attribute):
        if call.func.attr in WRITERS or any(part.arg == "out" for part in call.keywords):
            return given | _roots(call.func)
        return set()
    return set() if isinstance(call.func, ast.Name) and hasattr(builtins, call.func.id) else given


def _roots(node: ast.AST) -> set[str]:
    """Return the names that an expression may be a part of, or another name for."""
    if isinstance(node, ast.Name):
        return {node.id}
    if isinstance(node, ast.Attribute | ast.Subscript | ast.Starred):
        return _roots(node.value)
    if isinstance(node, ast.Tuple | ast.List):
        return set().union(*(_roots(part) for part in node.elts)) if node.elts else set()
    if isinstance(node, ast.IfExp):
        return _roots(node.body) | _roots(node.orelse)
    return set()


def _bound(target: ast.AST) -> set[str]:
    """Return the names that an assignment gives."""
    return {node.id for node in ast.walk(target) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}
