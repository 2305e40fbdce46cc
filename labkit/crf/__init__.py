"""CRF inference on pixel grids, with a certificate (topic 02). Read the modules in this order:

energy       the Potts energy, and what a solver returns
integers     the same energy in integers, so that bounds are proofs
exact        enumeration: Z, marginals and MAP of tiny grids; no pairwise term; two classes by a minimum cut
messages     TRW-S, which proves a lower bound, and ICM
cuts         many classes by a sequence of cuts: expansion moves
persistency  labels that are provably best, so that little is left to solve
mean_field   the closest distribution of independent pixels
dense        a CRF in which all pixels are neighbours
solvers      one entrance to all of them, and the refinement of a network's probabilities

Kernels compiled by numba live in the modules ending in `_kernels`; they are compiled on first use.
"""

from labkit.crf.dense import dense_crf
from labkit.crf.energy import MapResult, PottsCRF, unary_from_probabilities
from labkit.crf.exact import log_partition, marginals
from labkit.crf.solvers import METHODS, refine, solve
