"""How numba compiles a kernel's callees: to be linked into their callers, and for nothing else.

By itself numba optimises each function it compiles together with all that the function calls, and
makes machine code of it. In a nest of inlined callees every level would repeat the work of the
levels below, three quarters of the time of a large kernel, and only the outermost result is used.
"""

from typing import Any

from numba.core import types
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler


class LinkedLibrary(JITCodeLibrary):
    """The code of a callee: simplified by itself, optimised and made machine code in its callers.

    It has no address that Python could call, and so no place for an environment of Python objects.
    """

    def _optimize_final_module(self):
        """Leave it to the callers."""

    def _finalize_final_module(self):
        self._finalize_dynamic_globals()
        self._finalized = True

    def get_pointer_to_function(self, name):
        """Return 0, which stands for no address."""
        self._ensure_finalized()
        return 0

    @property
    def codegen(self):
        """The library itself, as numba asks only for `set_env`."""
        return self

    def set_env(self, name, environment):
        """Do nothing: without machine code no environment is read."""


# Passes for what no kernel has: closures, `with` blocks, overloads to inline, arguments of None.
NEEDLESS = {
    "WithLifting",
    "InlineClosureLikes",
    "MakeFunctionToJitFunction",
    "InlineInlinables",
    "InlineOverloads",
    "FindLiterallyCalls",
    "LiteralUnroll",
    "DeadBranchPrune",
}


class LinkedCompiler(Compiler):
    """Numba's compiler, writing into a LinkedLibrary, without passes for what no kernel has."""

    def define_pipelines(self):
        """Return numba's passes without the needless ones."""
        self.state.library = LinkedLibrary(self.state.targetctx.codegen(), "callee")
        pipelines = super().define_pipelines()
        for pipeline in pipelines:
            pipeline.passes = [p for p in pipeline.passes if p[0].__name__ not in NEEDLESS]
        return pipelines


def ignore_literals(dispatcher: Any) -> Any:
    """Let a callee be compiled once for integers, not again for each that a call spells out.

    Inlined code knows the numbers anyway.
    """
    resolve = dispatcher.get_call_template

    def get_call_template(args, kws):
        return resolve([types.unliteral(kind) for kind in args], kws)

    dispatcher.get_call_template = get_call_template
    return dispatcher
