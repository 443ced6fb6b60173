"""Numba's cache of compiled kernels on disk, without errors for invalid files.

Numba's files are pickles of types, machine code and their signatures. A file that is truncated or
changed, or names a class that has moved, would raise an error in a user's call. Here such a file
counts as absent: the kernel is compiled again and the file replaced.

Of the processes that need a kernel at the same time one compiles it; the others wait for its file.
"""

import contextlib
import hashlib
import pickle
from collections.abc import Callable
from typing import Any

from numba.core.caching import FunctionCache, IndexDataCacheFile
from numba.core.compiler_lock import global_compiler_lock

# Seconds to wait for another process at the most, as it may have been stopped; the largest kernel
# is compiled within a minute on a busy machine.
LONGEST_WAIT = 120.0


class CheckedCacheFile(IndexDataCacheFile):
    """An index and its data files; machine code comes with its hash."""

    def _load_index(self) -> dict[Any, str]:
        try:
            return super()._load_index()
        except Exception:  # whatever a pickle of unknown content may raise
            return {}

    def _save_data(self, name: str, data: Any) -> None:
        content = self._dump(data)
        super()._save_data(name, (hashlib.sha256(content).digest(), content))

    def _load_data(self, name: str) -> Any:
        expected, content = super()._load_data(name)
        if hashlib.sha256(content).digest() != expected:
            raise ValueError(f"{name}: changed since it was written")
        return pickle.loads(content)


class DiskCache(FunctionCache):
    """The cache of a kernel; reading, locking and writing raise no error."""

    def __init__(self, kernel: Any):
        super().__init__(kernel)
        locator, base = self._impl.locator, self._impl.filename_base
        self._cache_file = CheckedCacheFile(self.cache_path, base, locator.get_source_stamp())
        self._held = contextlib.ExitStack()  # of the lock, while this process compiles

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the compiled version for a signature, None if this process has to compile it."""
        version = self._load_valid(sig, target_context)
        if version is None and self._lock():
            version = self._load_valid(sig, target_context)
        return version

    def save_overload(self, sig: Any, data: Any) -> None:
        """Save a compiled version, unless the disk is full or may not be written to."""
        with contextlib.suppress(OSError):
            super().save_overload(sig, data)

    def unlocking(self, compile_version: Callable[[Any], Any]) -> Callable[[Any], Any]:
        """Return a method that compiles and then lets other processes read what it saved."""

        def compile_unlocking(sig: Any) -> Any:
            with global_compiler_lock, self._held:
                return compile_version(sig)

        return compile_unlocking

    def _load_valid(self, sig: Any, target_context: Any) -> Any:
        try:
            return super().load_overload(sig, target_context)
        except Exception:  # whatever a pickle of unknown content may raise
            return None

    def _lock(self) -> bool:
        """Wait for other processes that compile the kernel; False where no file can be locked."""
        import filelock  # needed for compilation only

        lock = filelock.FileLock(f"{self._cache_file._index_path}.lock", timeout=LONGEST_WAIT)
        with contextlib.suppress(OSError, RuntimeError):
            self._held.enter_context(lock)
            return True
        return False


def use_cache(dispatcher: Any) -> None:
    """Keep a kernel's compiled versions on disk, if there is a writable folder."""
    try:
        cache = dispatcher._cache = DiskCache(dispatcher.py_func)
    except RuntimeError:  # numba found no folder
        return
    dispatcher.compile = cache.unlocking(dispatcher.compile)
