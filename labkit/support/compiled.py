"""How numba compiles the loops in the modules ending in `_kernels`.

A kernel is called from Python; what it is compiled to is kept in a file beside the code. A part is called by kernels
and other parts only. It compiles faster, as it needs no entrance from Python and no file; called from Python it would
run as Python. Arrays are made outside, and loops say what NumPy's functions would: numba takes longer to compile
`np.full`, `x.min()` or `x[:] = 0` than a loop.
"""

from numba import njit
from numba.extending import register_jitable

kernel = njit(cache=True, nogil=True)
part = register_jitable
