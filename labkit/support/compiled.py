"""How numba compiles the loops in the modules ending in `_kernels`, and where it keeps what it compiled.

A kernel is called from Python; what it is compiled to is kept in files beside the code. What is `inline` is called by
kernels and their like only. It compiles faster, as it needs no entrance from Python and no file; called from Python it
would run as Python. Arrays are made outside, and loops say what NumPy's functions would: numba takes longer to compile
`np.full`, `x.min()` or `x[:] = 0` than a loop.
"""

import os
from pathlib import Path

from numba import config, njit
from numba.core import caching
from numba.extending import register_jitable

from labkit.support.files import write_atomically

KERNELS = []  # all whose modules are loaded
UserWide = getattr(caching, "UserWideCacheLocator", None) or caching._UserWideCacheLocator  # the name before numba 0.62
inline = register_jitable


def kernel(function):
    """Compile a function for each kind of arguments when they first come, or load what an earlier process compiled."""
    KERNELS.append(njit(cache=True, nogil=True)(function))
    return KERNELS[-1]


class CopyOfSharedCache(UserWide):
    """The user's own cache of a kernel, to which whatever is newer beside the code is copied first.

    Numba reads a cache only in a folder that it may write to. The users of one read-only installation would each
    compile everything, though `labkit doctor --warm` left all of it beside the code.
    """

    @classmethod
    def from_function(cls, py_func, py_file):
        shared = Path(py_file).parent / "__pycache__"
        kept = sorted(shared.glob(f"{Path(py_file).stem}.{py_func.__qualname__}-*.nb[ci]"))  # the index comes last
        if config.CACHE_DIR or not kept or os.access(shared, os.W_OK):
            return None  # numba's own choices hold
        own = super().from_function(py_func, py_file)
        for file in kept if own else ():
            copy = Path(own.get_cache_path()) / file.name
            if not copy.exists() or copy.stat().st_mtime < file.stat().st_mtime:
                write_atomically(copy, file.read_bytes())
        return own


# Asked first, unless the user's NUMBA_CACHE_LOCATOR_CLASSES (which numba knows since 0.62) names others.
caching.CacheImpl._locator_classes = [CopyOfSharedCache, *caching.CacheImpl._locator_classes]
