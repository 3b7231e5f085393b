"""Functions that kernels call: compiled once per signature, to be linked into kernels, and never run by themselves."""

from __future__ import annotations

import dis
import gc
from functools import cached_property
from types import FunctionType
from typing import Any

import numba
from numba.core import compiler, types
from numba.core.codegen import JITCodeLibrary
from numba.core.registry import CPUDispatcher


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


class KernelCompiler(compiler.Compiler):
    """Compiles functions that are called from Python, with inner functions of this module linked into them.

    Meanwhile garbage is not collected: that is a seventh of the time, and finds nothing while a kernel is made.
    """

    def compile_extra(self, func: FunctionType) -> Any:
        collects = gc.isenabled()
        gc.disable()
        try:
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

    def get_call_template(self, args, kws):
        """Numba would compile a function once more for each constant, such as True, that a call passes."""
        return super().get_call_template(tuple(map(types.unliteral, args)), kws)

    def __call__(self, *values: Any) -> Any:
        return self._from_python(*values)

    @cached_property
    def _from_python(self) -> Any:
        options: dict[str, Any] = {**self.targetoptions, "no_cpython_wrapper": False}
        return numba.jit(**options, pipeline_class=KernelCompiler)(self.py_func)
