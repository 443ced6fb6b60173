"""How numba compiles kernels: each callee by itself, all linked into the kernel that Python calls.

By itself numba optimises each function it compiles together with all that the function calls, and
makes machine code of it. In a nest of inlined callees every level would repeat the work of the
levels below, three quarters of the time of a large kernel, and only the outermost result is used.
"""

from typing import Any

from numba.core import types
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, Flags


class LinkedLibrary(JITCodeLibrary):
    """The code of a callee: simplified by itself, linked, optimised and made machine code outside.

    It has no address that Python could call, and so no place for an environment of Python objects.
    """

    def _optimize_functions(self, module: Any) -> None:
        """Simplify what the module defines, not what it declares: both cost the same."""
        module.data_layout = self._codegen._data_layout
        for function in module.functions:
            if not function.is_declaration:
                passes, builder = self._codegen._function_pass_manager()
                passes.run(function, builder)

    def finalize(self) -> None:
        """Leave linking, optimisation and machine code to the kernel's library."""
        self._raise_if_finalized()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """Return 0, which stands for no address."""
        self._ensure_finalized()
        return 0

    @property
    def codegen(self) -> Any:
        """The library itself, as numba asks only for `set_env`."""
        return self

    def set_env(self, name: str, environment: Any) -> None:
        """Do nothing: without machine code no environment is read."""


class KernelLibrary(JITCodeLibrary):
    """The code of a kernel, with that of its callees and of theirs linked into it, each once."""

    def add_linking_library(self, library: Any) -> None:
        """Add a library and those that it would have linked."""
        super().add_linking_library(library)
        if isinstance(library, LinkedLibrary):
            for one in library._linking_libraries:
                if one not in self._linking_libraries:
                    self.add_linking_library(one)


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

    def define_pipelines(self) -> Any:
        """Return numba's passes without the needless ones."""
        self.state.library = LinkedLibrary(self.state.targetctx.codegen(), "callee")
        pipelines = super().define_pipelines()
        for pipeline in pipelines:
            pipeline.passes = [p for p in pipeline.passes if p[0].__name__ not in NEEDLESS]
        return pipelines


class KernelCompiler(Compiler):
    """Numba's compiler, writing into a KernelLibrary."""

    def define_pipelines(self) -> Any:
        """Return numba's passes."""
        self.state.library = KernelLibrary(self.state.targetctx.codegen(), "kernel")
        self.state.library.enable_object_caching()
        return super().define_pipelines()


class FixedFlags(Flags):
    """Numba's options of a compilation that are no longer changed, and so hashed only once.

    Numba looks up ten thousand implementations by them in compiling one large kernel.
    """

    __slots__ = ["_hash"]

    def __init__(self, flags: Any) -> None:
        super().__init__(flags)
        self._hash = super().__hash__()

    def __hash__(self) -> int:
        return self._hash

    def copy(self) -> Any:
        """Return the flags themselves."""
        return self


# All flags in use: equal ones are one object, which is quick to compare.
_known: dict[FixedFlags, FixedFlags] = {}


def fix_flags(dispatcher: Any) -> Any:
    """Let a kernel be compiled with FixedFlags."""

    def fixed(flags: Any) -> FixedFlags:
        new = FixedFlags(flags)
        return _known.setdefault(new, new)

    dispatcher._compiler._customize_flags = fixed
    return dispatcher


def compile_directly(dispatcher: Any) -> Any:
    """Let a callee be compiled once for integers, not again for each that a call spells out.

    Inlined code knows the numbers anyway. Timers are left out, of which there would be two for each
    caller above it.
    """
    resolve = dispatcher.get_call_template

    def get_call_template(args: Any, kws: Any) -> Any:
        args = [types.unliteral(kind) for kind in args]
        _, folded = dispatcher._compiler.fold_argument_types(args, kws)
        if folded not in dispatcher.overloads:
            dispatcher.add_overload(dispatcher._compiler.compile(folded, None))
        return resolve(args, kws)

    dispatcher.get_call_template = get_call_template
    return fix_flags(dispatcher)
