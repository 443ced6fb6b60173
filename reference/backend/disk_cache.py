"""Numba's cache of compiled kernels on disk, without errors for invalid files.

Numba's files are pickles of types, machine code and their signatures. A file that is truncated or
changed, or names a class that has moved, would raise an error in a user's call. Here such a file
counts as absent: the kernel is compiled again and the file replaced.
"""

import hashlib
import pickle
from typing import Any

from numba.core.caching import FunctionCache, IndexDataCacheFile


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
    """The cache of a kernel; reading and writing raise no error."""

    def __init__(self, kernel: Any):
        super().__init__(kernel)
        locator = self._impl.locator
        self._cache_file = CheckedCacheFile(
            self.cache_path, self._impl.filename_base, locator.get_source_stamp()
        )

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the compiled version for a signature, None if there is no valid file."""
        try:
            return super().load_overload(sig, target_context)
        except Exception:  # whatever a pickle of unknown content may raise
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Save a compiled version, unless the disk is full or may not be written to."""
        try:
            super().save_overload(sig, data)
        except OSError:
            return


def use_cache(dispatcher: Any) -> None:
    """Keep a kernel's compiled versions on disk, if there is a writable folder."""
    try:
        dispatcher._cache = DiskCache(dispatcher.py_func)
    except RuntimeError:  # numba found no folder
        return
