"""A kernel enters, LLVM's text of it leaves (by numba); that text enters, machine code leaves, and a place to call it at (by llvmlite).

numba takes half a second to load and as long again to look around, before it does anything; its library llvmlite, which makes and
loads the machine code, a tenth of a second. So numba is asked only for a kernel that nobody has seen yet.

What numba makes of ``f(a, b)`` is a function ``int f(result*, error**, a…, b…)`` in which an array is seven things or more: who holds
its memory, which Python object it is, its size, that of an element, the address, shape and strides. Nobody holds an argument's
memory here. The memory of a result is held by a block of ours, so that nothing of numba's runtime is needed.
Around it we put ``int entry(numbers*, results*, error**)``, whose arguments are rows of eight bytes (see `signature`).
"""

from __future__ import annotations

import ctypes
import pickle
import struct
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import cache
from typing import Any

from ratherthan.model.compiling.signature import NUMBER, TRUTH, Leaf, UnusualError, leaves

__all__ = ["Place", "code_of", "machine", "plain", "text_by_numba"]

ENTRY = "ratherthan_entry"
NATIVE = "ratherthan_native"
HEADER = 64
"""Bytes of a block of memory before the elements begin."""
RUNTIME = f"""
declare ptr @ratherthan_take(i64)
declare void @ratherthan_give(ptr)
define void @NRT_MemInfo_call_dtor(ptr %block) {{
  call void @ratherthan_give(ptr %block)
  ret void
}}
define noalias ptr @NRT_Allocate(i64 %size) {{
  %more = call ptr @ratherthan_take(i64 %size)
  ret ptr %more
}}
define void @NRT_Free(ptr %block) {{
  call void @ratherthan_give(ptr %block)
  ret void
}}
define noalias ptr @NRT_MemInfo_alloc(i64 %size) {{
  %block = call ptr @NRT_MemInfo_alloc_aligned(i64 %size, i32 16)
  ret ptr %block
}}
define noalias ptr @NRT_MemInfo_alloc_aligned(i64 %size, i32 %align) {{
  %wide = zext i32 %align to i64
  %more = add i64 %wide, {HEADER}
  %total = add i64 %size, %more
  %fits = icmp ugt i64 %total, %size
  br i1 %fits, label %ask, label %none
ask:
  %block = call ptr @ratherthan_take(i64 %total)
  %failed = icmp eq ptr %block, null
  br i1 %failed, label %none, label %fill
fill:
  %at = ptrtoint ptr %block to i64
  %end = add i64 %at, %more
  %off = urem i64 %end, %wide
  %data = sub i64 %end, %off
  %begin = inttoptr i64 %data to ptr
  %p1 = getelementptr i64, ptr %block, i64 1
  %p2 = getelementptr i64, ptr %block, i64 2
  %p3 = getelementptr i64, ptr %block, i64 3
  %p4 = getelementptr i64, ptr %block, i64 4
  %p5 = getelementptr i64, ptr %block, i64 5
  store i64 1, ptr %block
  store ptr null, ptr %p1
  store ptr null, ptr %p2
  store ptr %begin, ptr %p3
  store i64 %size, ptr %p4
  store ptr null, ptr %p5
  ret ptr %block
none:
  ret ptr null
}}
"""
LLVM_TYPES = {"b1": "i8", "i1": "i8", "u1": "i8", "i2": "i16", "u2": "i16", "i4": "i32", "u4": "i32", "i8": "i64"}
LLVM_TYPES |= {"u8": "i64", "f4": "float", "f8": "double"}


DAMAGED = (EOFError, pickle.UnpicklingError, ImportError, AttributeError, UnicodeDecodeError)


class Place:
    """Machine code that is loaded: where to call it. It stays for as long as the process does."""

    def __init__(self, code: bytes) -> None:
        llvm = _llvm()
        _offer_memory()
        engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), _target_machine())
        try:
            engine.add_object_file(llvm.object_file.ObjectFileRef.from_data(code))
            engine.finalize_object()
            address = engine.get_function_address(ENTRY)
        finally:
            engine.detach()  # never taken down: with it would go the machine that all engines share
        if not address:
            raise UnusualError("code without an entry")
        self.call = ctypes.CFUNCTYPE(ctypes.c_int32, ctypes.c_char_p, ctypes.c_void_p, ctypes.c_void_p)(address)


@cache
def _llvm() -> Any:
    """Return llvmlite, made ready; the short way is known for little-endian machines of 64 bits with Unix's calls."""
    if sys.platform not in ("linux", "darwin") or sys.byteorder != "little" or struct.calcsize("P") != 8:
        raise UnusualError("another kind of machine")
    import llvmlite.binding as llvm

    with suppress(RuntimeError):  # later versions do it themselves and refuse to be asked
        llvm.initialize()
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    return llvm


@cache
def _target_machine() -> Any:
    """Return what makes machine code for this processor."""
    llvm = _llvm()
    target = llvm.Target.from_triple(llvm.get_process_triple())
    return target.create_target_machine(
        cpu=llvm.get_host_cpu_name(),
        features=llvm.get_host_cpu_features().flatten(),
        opt=3,
        reloc="static" if target.name.startswith("x86") else "default",
        codemodel="jitdefault",
        jit=True,
    )


@cache
def machine() -> tuple[str, ...]:
    """Return what machine code depends on besides the kernel: the compiler, the processor, and what we put around it."""
    llvm = _llvm()
    version = ".".join(str(part) for part in llvm.llvm_version_info)
    return (
        version,
        llvm.get_process_triple(),
        llvm.get_host_cpu_name(),
        llvm.get_host_cpu_features().flatten(),
        RUNTIME,
    )


@cache
def _offer_memory() -> None:
    """Let kernels take memory from where Python takes it, and give it back there."""
    llvm = _llvm()
    for name, function in (("take", ctypes.pythonapi.PyMem_RawMalloc), ("give", ctypes.pythonapi.PyMem_RawFree)):
        address = ctypes.cast(function, ctypes.c_void_p).value
        llvm.add_symbol(f"ratherthan_{name}", address)


def code_of(text: str, types: Sequence[Any], result: Any) -> bytes:
    """Return machine code for LLVM's text of a kernel.

    Parameters
    ----------
    text : str
        With the kernel's function under the name of `NATIVE`.
    types : sequence
        Of the arguments, see `signature`.
    result
        What it returns: None; "<i8" and the like; ["array", dtype, dimensions, locked]; ["tuple", name of its class, parts].

    Raises
    ------
    UnusualError
        If the function is not as was expected, or needs what there is not.
    """
    llvm = _llvm()
    try:
        module = llvm.parse_assembly(text)
        _check(module, types)
        module.link_in(llvm.parse_assembly(RUNTIME))
        module.link_in(llvm.parse_assembly(_entry(types, result)))
        module.triple = llvm.get_process_triple()
        module.data_layout = str(_target_machine().target_data)
        module.verify()
    except RuntimeError as error:  # LLVM's own: a text of a version that it does not know
        raise UnusualError(str(error)) from error
    for function in module.functions:
        if function.is_declaration:
            known = function.name.startswith(("llvm.", "ratherthan_"))
            if not known and not llvm.address_of_symbol(function.name):
                raise UnusualError(f"a function {function.name}")
    code: bytes = _target_machine().emit_object(module)
    return code


def _check(module: Any, types: Sequence[Any]) -> None:
    """Raise UnusualError unless the kernel's function takes what will be given."""
    function = module.get_function(NATIVE)
    wanted = ["ptr", "ptr", *(kind for leaf in leaves(types) for kind in _taken(leaf))]
    got = [str(argument.type) for argument in function.arguments]
    if got != wanted:
        raise UnusualError(f"a function of {', '.join(got)}")


def _taken(leaf: Leaf) -> list[str]:
    """Return LLVM's types of one argument."""
    dtype, dimensions, _ = leaf
    if dimensions < 0:
        return [LLVM_TYPES[dtype[1:]]]
    return ["ptr", "ptr", "i64", "i64", "ptr", *["i64"] * (2 * dimensions)]


def _entry(types: Sequence[Any], result: Any) -> str:
    """Return LLVM's text of the function that takes and returns rows of eight bytes."""
    lines: list[str] = []
    given = ["ptr %result", "ptr %error"]
    slot = 0

    def load(kind: str) -> str:
        nonlocal slot
        lines.append(f"  %a{slot} = getelementptr i64, ptr %numbers, i64 {slot}")
        lines.append(f"  %v{slot} = load {kind}, ptr %a{slot}")
        slot += 1
        return f"{kind} %v{slot - 1}"

    for leaf in leaves(types):
        dtype, dimensions, _ = leaf
        if leaf == TRUTH:
            given.append(load("i8"))
        elif dimensions < 0:
            given.append(load("double" if leaf == NUMBER else "i64"))
        else:
            data, size = load("ptr"), load("i64")
            given += ["ptr null", "ptr null", size, f"i64 {int(dtype[2:])}", data]
            given += [load("i64") for _ in range(2 * dimensions)]
    kind = _result_type(result)
    back = _stores(result, kind)
    native = ", ".join(item.split(" ")[0] for item in given)
    return "\n".join(
        [
            f"declare i32 @{NATIVE}({native})",
            f"define i32 @{ENTRY}(ptr %numbers, ptr %results, ptr %error) {{",
            f"  %result = alloca {kind}, align 16",
            f"  store {kind} zeroinitializer, ptr %result",
            *lines,
            f"  %code = call i32 @{NATIVE}({', '.join(given)})",
            *back,
            "  ret i32 %code",
            "}",
        ]
    )


def _result_type(result: Any) -> str:
    """Return LLVM's type of a result."""
    if result is None:
        return "ptr"
    if isinstance(result, str):
        return LLVM_TYPES[result[1:]]
    if result[0] == "array":
        return f"{{ ptr, ptr, i64, i64, ptr, [{result[2]} x i64], [{result[2]} x i64] }}"
    return "{ " + ", ".join(_result_type(part) for part in result[2]) + " }"


def _stores(result: Any, kind: str) -> list[str]:
    """Return the lines that lay out a result in rows of eight bytes: of an array, what holds it, address, shape and strides."""
    lines: list[str] = []
    for slot, (path, leaf) in enumerate(_results(result, ())):
        at = "".join(f", i32 {i}" for i in path)
        loaded = LLVM_TYPES[leaf[1:]] if leaf != "ptr" else "ptr"
        lines.append(f"  %r{slot} = getelementptr {kind}, ptr %result, i32 0{at}")
        lines.append(f"  %x{slot} = load {loaded}, ptr %r{slot}")
        wide = f"%x{slot}"
        if loaded in ("i8", "i16", "i32"):
            lines.append(f"  %w{slot} = {'sext' if leaf[1] == 'i' else 'zext'} {loaded} %x{slot} to i64")
            loaded, wide = "i64", f"%w{slot}"
        elif loaded == "float":
            lines.append(f"  %w{slot} = fpext float %x{slot} to double")
            loaded, wide = "double", f"%w{slot}"
        lines.append(f"  %s{slot} = getelementptr i64, ptr %results, i64 {slot}")
        lines.append(f"  store {loaded} {wide}, ptr %s{slot}")
    return lines


def _results(result: Any, path: tuple[int, ...]) -> list[tuple[tuple[int, ...], str]]:
    """Return where in a result its numbers are, and their types."""
    if result is None:
        return []
    if isinstance(result, str):
        return [(path, result)]
    if result[0] == "array":
        places = [((*path, 0), "ptr"), ((*path, 4), "ptr")]
        return places + [((*path, field, i), "<i8") for field in (5, 6) for i in range(result[2])]
    return [place for i, part in enumerate(result[2]) for place in _results(part, (*path, i))]


def text_by_numba(kernel: Callable[..., Any], types: Sequence[Any]) -> tuple[str, Any]:
    """Return LLVM's text of a kernel for arguments of these types, and what it returns.

    Raises
    ------
    UnusualError
        If it returns what the short way does not know.
    """
    import numba
    from numba.core.errors import NumbaError

    dispatcher = numba.njit(nogil=True, no_cpython_wrapper=True, no_cfunc_wrapper=True)(kernel)
    try:
        dispatcher.compile(tuple(_numba_types(numba, list(types))))
    except NumbaError as error:  # numba's own way says what is wrong with it
        raise UnusualError(str(error)) from error
    (signature,) = dispatcher.signatures
    made = dispatcher.overloads[signature]
    if made.library.has_dynamic_globals:
        raise UnusualError("addresses of this process")
    result = _described(numba, made.signature.return_type)
    llvm = _llvm()
    module = llvm.parse_assembly(dispatcher.inspect_llvm(signature))
    module.get_function(made.fndesc.llvm_func_name).name = NATIVE
    for value in (*module.functions, *module.global_variables):
        if not value.is_declaration and value.name != NATIVE:
            value.linkage = "internal"
    return str(module), result


def _numba_types(numba: Any, types: list[Any]) -> list[Any]:
    """Return numba's types of arguments; `types` is used up."""
    made: list[Any] = []
    while types:
        made.append(_numba_type(numba, types))
    return made


def _numba_type(numba: Any, types: list[Any]) -> Any:
    """Return numba's type of the first argument, and take it away."""
    kind = types.pop(0)
    if not isinstance(kind[0], str):
        parts = [_numba_type(numba, types) for _ in range(kind[1])]
        return numba.types.BaseTuple.from_types(parts, None if kind[0] is tuple else kind[0])
    dtype, dimensions, contiguous = kind
    if dimensions < 0:
        return {"f8": numba.types.float64, "b1": numba.types.boolean}.get(dtype[1:], numba.types.int64)
    import numpy as np

    return numba.types.Array(numba.from_dtype(np.dtype(dtype)), dimensions, "C" if contiguous else "A")


def _described(numba: Any, kind: Any) -> Any:
    """Return what a kernel returns in words that JSON can hold."""
    types = numba.types
    if isinstance(kind, types.NoneType):
        return None
    if isinstance(kind, types.Array) and kind.ndim > 0:
        return ["array", _dtype(numba, kind.dtype), kind.ndim, not kind.mutable]
    if isinstance(kind, types.BaseTuple) and len(kind) > 0:
        named = kind.instance_class if isinstance(kind, types.BaseNamedTuple) else None
        place = None if named is None else f"{named.__module__}:{named.__qualname__}"
        return ["tuple", place, [_described(numba, part) for part in kind]]
    return _dtype(numba, kind)


def _dtype(numba: Any, kind: Any) -> str:
    """Return numpy's name for a type of numbers."""
    if not isinstance(kind, numba.types.Integer | numba.types.Float | numba.types.Boolean):
        raise UnusualError(f"a result of {kind}")
    name: str = numba.np.numpy_support.as_dtype(kind).str
    return name


@cache
def plain(kernel: Callable[..., Any]) -> Callable[..., Any]:
    """Return a kernel compiled, kept and called by numba alone; where what numba kept is damaged, it is compiled anew."""
    import numba

    from ratherthan.model.compiling.store import folder

    place = folder()
    if place is not None and not numba.config.CACHE_DIR:
        numba.config.CACHE_DIR = str(place)
    compiled: Callable[..., Any] = numba.njit(cache=place is not None, nogil=True)(kernel)

    def run(*arguments: Any) -> Any:
        nonlocal compiled
        try:
            return compiled(*arguments)
        except DAMAGED:  # raised while it is loaded: the kernel has not run
            compiled = numba.njit(nogil=True)(kernel)
            return compiled(*arguments)

    return run
