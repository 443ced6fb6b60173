"""Compile each callee of a kernel once and link all callees into the kernel called by Python.

Numba alone optimises each function together with all its callees and makes machine code of all. In
a nest of inlined callees every level would repeat the work of the levels below, half of the time of
a large kernel. Only the outermost result is used. The classes replace undocumented methods of
numba: with an untested series of numba, numba compiles as usual.
"""

from typing import Any

import numba
from numba.core import types
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler

# The first and the last tested series of numba.
OLDEST, NEWEST = (0, 61), (0, 68)
# The first series whose functions are optimised by the new pass managers of LLVM.
NEW_PASSES = (0, 62)


class LinkedLibrary(JITCodeLibrary):
    """The code of a callee: simplified by itself, linked, optimised and made machine code outside.

    It has no address for Python to call, and so no place for an environment of Python objects.
    """

    def _optimize_functions(self, module: Any) -> None:
        """Simplify the definitions of the module but not its declarations."""
        codegen: Any = self._codegen  # whose methods differ between series
        module.data_layout = codegen._data_layout
        functions = [function for function in module.functions if not function.is_declaration]
        if _series() < NEW_PASSES:
            with codegen._function_pass_manager(module) as passes:
                passes.initialize()
                for function in functions:
                    passes.run(function)
                passes.finalize()
        else:
            for function in functions:
                passes, builder = codegen._function_pass_manager()
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
        """Ignore numba's environment, which only machine code of this library would read."""


class KernelLibrary(JITCodeLibrary):
    """The code of a kernel, linked with the code of all direct and indirect callees, each once."""

    def add_linking_library(self, library: Any) -> None:
        """Add a library and the libraries to be linked into it."""
        super().add_linking_library(library)
        if isinstance(library, LinkedLibrary):
            for linked in library._linking_libraries:
                if linked not in self._linking_libraries:
                    self.add_linking_library(linked)


class LinkedCompiler(Compiler):
    """Numba's compiler, writing into a LinkedLibrary."""

    def define_pipelines(self) -> Any:
        """Return numba's passes."""
        self.state.library = LinkedLibrary(self.state.targetctx.codegen(), "callee")
        return super().define_pipelines()


class KernelCompiler(Compiler):
    """Numba's compiler, writing into a KernelLibrary."""

    def define_pipelines(self) -> Any:
        """Return numba's passes."""
        self.state.library = KernelLibrary(self.state.targetctx.codegen(), "kernel")
        self.state.library.enable_object_caching()
        return super().define_pipelines()


def is_supported() -> bool:
    """Return whether these classes are tested with this series of numba."""
    return OLDEST <= _series() <= NEWEST


def _series() -> tuple[int, ...]:
    return tuple(map(int, numba.__version__.split(".")[:2]))


def compile_directly(dispatcher: Any) -> Any:
    """Compile a callee once for all integers, and not again for each literal in a call.

    Inlined code contains the numbers anyway. Numba's timers, two for each caller, are left out.
    """
    resolve = dispatcher.get_call_template

    def get_call_template(args: Any, kws: Any) -> Any:
        args = [types.unliteral(kind) for kind in args]
        _, folded = dispatcher._compiler.fold_argument_types(args, kws)
        if folded not in dispatcher.overloads:
            dispatcher.add_overload(dispatcher._compiler.compile(folded, None))
        return resolve(args, kws)

    dispatcher.get_call_template = get_call_template
    return dispatcher
