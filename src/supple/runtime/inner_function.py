"""Functions that kernels call: compiled once per signature, to be linked into kernels, and never run by themselves."""

from __future__ import annotations

import dis
import gc
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cached_property
from types import FunctionType
from typing import Any

import numba
from numba.core import compiler, types
from numba.core.codegen import JITCodeLibrary
from numba.core.registry import CPUDispatcher
from numba.core.targetconfig import ConfigStack


class Flags(compiler.Flags):
    """Numba's, equal where functions that are compiled for a caller with these flags come out the same.

    Numba compiles its own functions, such as `np.empty`, again for each set of flags of a caller, and compares flags at
    every call that it types: 160,000 times for a first frame.
    """

    # What functions inherit, see `numba.core.cpu.CPUTargetOptions.finalize`.
    INHERITED = ("nrt", "fastmath", "error_model", "forceinline")

    def __hash__(self) -> int:
        return 0  # Numba's own is the same for all flags, too: it sorts their names

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Flags):
            return super().__eq__(other)
        return self._values == other._values or all(
            getattr(self, name) == getattr(other, name) for name in self.INHERITED
        )


def compare_quickly(dispatcher: Any) -> None:
    """Let a function be compiled with `Flags` of this module."""
    dispatcher._compiler._customize_flags = Flags


class _LinkedLibrary(JITCodeLibrary):
    """Code to be linked into kernels. No machine code is made of it: what is not inlined is compiled in each kernel."""

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        self._ensure_finalized()
        return 0

    @property
    def codegen(self) -> _LinkedLibrary:
        """What is asked to set the environment; a kernel sets those of all that is linked into it."""
        return self

    def set_env(self, env_name: str, env: Any) -> None:
        """Nothing is in memory here."""


class _LinkedCompiler(compiler.Compiler):
    def __init__(self, *state: Any) -> None:
        super().__init__(*state)
        if self.state.library is None:
            self.state.library = _LinkedLibrary(self.state.targetctx.codegen(), "inner function")


_OPERATIONS: dict[tuple[Any, ...], tuple[Any, Any]] = {}  # signature and implementation of operations on numbers


@contextmanager
def _known_operations(context: Any) -> Iterator[None]:
    """Meanwhile the types of an operation on numbers, such as a product of two floats, are found once.

    Numba asks every implementation of the operation at every use; there are 30 times as many uses as operations.
    """
    resolve = context.resolve_function_type

    def resolve_once(function: Any, args: Any, kws: Any) -> Any:
        numbers = all(isinstance(entry, (types.Number, types.Boolean)) for entry in args)
        if kws or not numbers or function.__class__ is not types.Function:
            return resolve(function, args, kws)
        flags = ConfigStack().top()
        key = (function, args, *(str(getattr(flags, name)) for name in Flags.INHERITED))
        if key not in _OPERATIONS:
            signature = resolve(function, args, kws)
            if signature is None:
                return None
            _OPERATIONS[key] = signature, function.get_impl_key(signature)
        signature, function._impl_keys[signature.args] = _OPERATIONS[key]
        return signature

    context.resolve_function_type = resolve_once
    try:
        yield
    finally:
        context.resolve_function_type = resolve


class KernelCompiler(compiler.Compiler):
    """Compiles functions that are called from Python, with inner functions of this module linked into them.

    Meanwhile garbage is not collected: that is a seventh of the time, and finds nothing while a kernel is made.
    """

    def compile_extra(self, func: FunctionType) -> Any:
        collects = gc.isenabled()
        gc.disable()
        try:
            with _known_operations(self.state.typingctx):
                result = super().compile_extra(func)
        finally:
            if collects:
                gc.enable()
        for environment in result._find_referenced_environments():
            result.codegen.set_env(environment.env_name, environment)
        return result


def inlined_size(function: FunctionType) -> int:
    """Bytes of the bytecode of a function, with those of the inner functions that are inlined where it calls them."""
    called = (
        function.__globals__.get(step.argval) for step in dis.get_instructions(function) if step.opname == "LOAD_GLOBAL"
    )
    inlined = [entry for entry in called if isinstance(entry, InnerFunction) and entry.targetoptions["forceinline"]]
    return len(function.__code__.co_code) + sum(inlined_size(entry.py_func) for entry in inlined)


class InnerFunction(CPUDispatcher):
    """A function that kernels call. It is compiled without a wrapper for calls from Python, and without machine code.

    Called from Python, as in tests, it is compiled once more, with both.
    """

    def __init__(self, py_func: FunctionType, locals: dict[str, Any], targetoptions: dict[str, Any]) -> None:
        super().__init__(py_func, locals, {**targetoptions, "no_cpython_wrapper": True}, _LinkedCompiler)
        compare_quickly(self)

    def get_call_template(self, args, kws):
        """Numba would compile a function once more for each constant, such as True, that a call passes."""
        return super().get_call_template(tuple(map(types.unliteral, args)), kws)

    def __call__(self, *values: Any) -> Any:
        return self._from_python(*values)

    @cached_property
    def _from_python(self) -> Any:
        options: dict[str, Any] = {**self.targetoptions, "no_cpython_wrapper": False}
        return numba.jit(**options, pipeline_class=KernelCompiler)(self.py_func)
