"""Kernels that other kernels call: intermediate code only.

numba turns every kernel into machine code of its own, optimised for itself, although a kernel that only others call is
inlined into them and optimised again there. Most of the time to compile went into that. Here a kernel that is called by
another one is taken no further than the intermediate code that the other one links; machine code is made for the
kernels that Python calls.

Python looks for cycles of dead objects all the time meanwhile: an eighth of the time to compile. Here it looks rarely.
"""

from __future__ import annotations

import gc
from typing import Any

from numba.core import sigutils
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, Flags
from numba.core.compiler_lock import global_compiler_lock
from numba.core.registry import CPUDispatcher

RARELY = (50_000, 20, 1000)
"""Thresholds of Python's search for cycles while a kernel is compiled: new objects before it, and how far it goes."""


class _Library(JITCodeLibrary):
    """Intermediate code of one kernel and of those that it calls."""

    def _optimize_final_module(self) -> None:
        """Leave that to the kernel that links it."""

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True


class KernelCompiler(Compiler):
    """numba's compiler of a kernel that Python calls."""

    def __init__(
        self, typing: Any, target: Any, library: Any, args: Any, returned: Any, flags: Flags, local: Any
    ) -> None:
        flags.no_cfunc_wrapper = True  # C calls none of them
        super().__init__(typing, target, library, args, returned, flags, local)

    def compile_extra(self, func: Any) -> Any:
        """Compile a function with few collections of garbage."""
        usual = gc.get_threshold()
        gc.set_threshold(*RARELY)
        try:
            return super().compile_extra(func)
        finally:
            gc.set_threshold(*usual)


class _IntermediateCompiler(KernelCompiler):
    """numba's compiler, into a library of intermediate code."""

    def __init__(
        self, typing: Any, target: Any, library: None, args: Any, returned: Any, flags: Flags, local: Any
    ) -> None:
        flags.no_compile = flags.no_cpython_wrapper = True
        super().__init__(typing, target, _Library(target.codegen(), "inlined"), args, returned, flags, local)


class Inlined(CPUDispatcher):
    """A kernel as other kernels call it."""

    @global_compiler_lock
    def compile(self, sig: Any) -> object:
        """Compile for the types of the arguments, and return the key under which numba finds the result."""
        args, returned = sigutils.normalize_signature(sig)
        if args not in self.overloads:
            made = self._compiler.compile(args, returned)._replace(entry_point=object())
            self.targetctx.insert_user_function(made.entry_point, made.fndesc, [made.library])
            self.overloads[args] = made
        return self.overloads[args].entry_point


def inline_in_kernels(dispatcher: CPUDispatcher) -> None:
    """Let other kernels take a compiled function by its intermediate code; Python calls it as before."""
    inlined = Inlined(dispatcher.py_func, targetoptions=dispatcher.targetoptions, pipeline_class=_IntermediateCompiler)
    dispatcher.get_call_template = inlined.get_call_template
    dispatcher.get_overload = inlined.get_overload
