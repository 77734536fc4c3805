"""Direct solvers for the symmetric tangent: analysed once, refactored at every new tangent.

MKL PARDISO through the library that pypardiso finds (its phases are driven here: pypardiso's own
calls copy and re-analyse the matrix), SuperLU where there is none. Both answer to round-off alike.
"""

import ctypes
import importlib
import importlib.metadata
import importlib.util
import os
import weakref
from contextlib import suppress
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.linalg import splu

from dftfs.errors import SolveError
from dftfs.fem.sparse import norm, symmetric_product

_NESTED_DISSECTION = 2
_INTEL_THREADS, _SEQUENTIAL = 0, 1
BLOCKS_FROM = 200_000  # unknowns
_BLOCKS = -80  # rows that share 80 % of their columns are one block
_THREADS = "DFTFS_SOLVER_THREADS"  # the environment's; 1 where it is not set
_MOST_THREADS = 256
_ROUND_TRIP_ERROR = 1e-2  # of a known solution: larger means a condition number beyond 1e14


class SymmetricSolver(Protocol):
    """Solves K x = b for K given by its upper triangle (CSR, zero-based, diagonal stored)."""

    name: str

    @property
    def negative_pivots(self) -> int:
        """Of the last factors: above 0 past a point of instability."""

    def factorise(self, data: NDArray[np.float64]) -> bool:
        """Factor K with these values; False if it is singular."""

    def solve(self, right: NDArray[np.float64]) -> NDArray[np.float64]:
        """Solve with the last factors; ``right`` is (n,)."""

    def close(self) -> None:
        """Free the factors."""


class PardisoSolver:
    """MKL PARDISO, on one thread unless the environment's `DFTFS_SOLVER_THREADS` says more.

    Without iterative refinement; the same number of threads gives the same bits.

    Cholesky until a tangent is not positive definite, from then on LDL^T with pivoting. Large
    matrices are kept as blocks of a node's unknowns inside: less memory, longer (of 155,000
    unknowns a fifth less, a third longer).
    """

    name = "pardiso"

    def __init__(self, indptr: NDArray[np.int32], indices: NDArray[np.int32]) -> None:
        self._indptr, self._indices = indptr, indices
        self._pardiso = _PardisoHandle(_mkl(), indptr, indices)
        self._trusted = False  # a body that moves freely shows in its first tangent
        # not __del__: a finalizer also runs before the interpreter takes the library apart
        self._finalizer = weakref.finalize(self, self._pardiso.release)

    def factorise(self, data: NDArray[np.float64]) -> bool:
        if not np.isfinite(data).all() or not self._pardiso.factorise(data):
            return False
        if not self._trusted:
            self._trusted = _reproduces(self, self._indptr, self._indices, data)
        return self._trusted

    def solve(self, right: NDArray[np.float64]) -> NDArray[np.float64]:
        return self._pardiso.solve(np.ascontiguousarray(right, dtype=float))

    @property
    def negative_pivots(self) -> int:
        return int(self._pardiso.iparm[22])

    def close(self) -> None:
        self._finalizer()


class _PardisoHandle:
    """PARDISO's memory for one sparsity pattern, and calls of its phases."""

    _ANALYSE, _FACTOR, _SOLVE, _RELEASE_FACTORS, _RELEASE = 11, 22, 33, 0, -1
    _POSITIVE_DEFINITE, _INDEFINITE = 2, -2

    def __init__(
        self, library: ctypes.CDLL, indptr: NDArray[np.int32], indices: NDArray[np.int32]
    ) -> None:
        self._library, self._indptr, self._indices = library, indptr, indices
        self._n = len(indptr) - 1
        self._data = self._none = np.zeros(0)
        self._memory = np.zeros(64, dtype=np.int64)
        self.iparm = np.zeros(64, dtype=np.int32)
        self.iparm[0] = 1  # no defaults: the entries below are the settings
        self.iparm[1] = _NESTED_DISSECTION
        self.iparm[9] = 13  # perturb pivots below 1e-13
        self.iparm[33] = solver_threads()  # sums in one order for so many threads
        self.iparm[17] = -1  # report the size of the factors
        self.iparm[20] = 1  # Bunch-Kaufman pivots
        self.iparm[34] = 1  # zero-based
        self.iparm[36] = _BLOCKS if self._n >= BLOCKS_FROM else 0
        self._kind = self._POSITIVE_DEFINITE
        self._analysed = False

    def factorise(self, data: NDArray[np.float64]) -> bool:
        self._data = data
        if not self._analysed:
            if self._call(self._ANALYSE, self._none, self._none) != 0:
                raise SolveError(f"PARDISO could not analyse a matrix of {self._n} unknowns")
            self._analysed = True
        elif self._n >= BLOCKS_FROM:  # else the matrix is copied into blocks beside old factors
            self._call(self._RELEASE_FACTORS, self._none, self._none)
        error = self._call(self._FACTOR, self._none, self._none)
        if error != 0 and self._kind == self._POSITIVE_DEFINITE:
            self.release()
            self._kind = self._INDEFINITE
            return self.factorise(data)
        perturbed_pivots = 13
        return error == 0 and self.iparm[perturbed_pivots] == 0

    def solve(self, right: NDArray[np.float64]) -> NDArray[np.float64]:
        solution = np.empty_like(right)
        error = self._call(self._SOLVE, right, solution)
        if error != 0:
            raise SolveError(f"PARDISO could not solve for {self._n} unknowns: its error {error}")
        return solution

    def release(self) -> None:
        if self._analysed:
            self._call(self._RELEASE, self._none, self._none)
            self._analysed = False
            if self._n >= BLOCKS_FROM:
                _trim_heap()

    def _call(self, phase: int, right: NDArray, solution: NDArray) -> int:
        def integer(value: int):
            return ctypes.byref(ctypes.c_int32(value))

        def array(values: NDArray):
            return values.ctypes.data_as(ctypes.c_void_p)

        error = ctypes.c_int32(0)
        self._library.pardiso(
            array(self._memory),
            *(integer(v) for v in (1, 1, self._kind, phase, self._n)),
            *(array(a) for a in (self._data, self._indptr, self._indices)),
            None,
            integer(1),
            array(self.iparm),
            integer(0),
            array(right),
            array(solution),
            ctypes.byref(error),
        )
        return error.value


class SuperLUSolver:
    """SciPy's SuperLU on the full matrix: several times slower, available everywhere."""

    name = "superlu"

    def __init__(self, indptr: NDArray[np.int32], indices: NDArray[np.int32]) -> None:
        self._indptr, self._indices = indptr, indices
        self._n = len(indptr) - 1
        self._factors = None

    def factorise(self, data: NDArray[np.float64]) -> bool:
        if not np.isfinite(data).all():
            return False
        upper = csr_array((data, self._indices, self._indptr), shape=(self._n, self._n))
        strict = upper.copy()
        strict.data[self._indptr[:-1]] = 0.0
        try:
            self._factors = splu(
                (upper + strict.T).tocsc(),
                permc_spec="MMD_AT_PLUS_A",
                diag_pivot_thresh=0.0,
                options={"SymmetricMode": True},
            )
        except RuntimeError:  # SuperLU's "Factor is exactly singular"
            return False
        return _reproduces(self, self._indptr, self._indices, data)

    def solve(self, right: NDArray[np.float64]) -> NDArray[np.float64]:
        return self._factors.solve(right)

    @property
    def negative_pivots(self) -> int:
        return int(np.count_nonzero(self._factors.U.diagonal() < 0))

    def close(self) -> None:
        self._factors = None


def make_solver(
    indptr: NDArray[np.int32], indices: NDArray[np.int32], *, prefer: str = "auto"
) -> SymmetricSolver:
    """A solver for a sparsity pattern (upper triangle, CSR).

    Parameters
    ----------
    prefer : {"auto", "pardiso", "superlu"}
        ``auto`` takes PARDISO where it is installed.

    Raises
    ------
    SolveError
        If the name is unknown, or PARDISO is asked for and missing.
    """
    if prefer not in ("auto", "pardiso", "superlu"):
        raise SolveError(f"solver '{prefer}' is unknown; allowed: auto, pardiso, superlu")
    if prefer == "superlu" or (prefer == "auto" and not _pardiso_installed()):
        return SuperLUSolver(indptr, indices)
    return PardisoSolver(indptr, indices)


def _reproduces(
    solver: SymmetricSolver,
    indptr: NDArray[np.int32],
    indices: NDArray[np.int32],
    data: NDArray[np.float64],
) -> bool:
    """Whether K^-1 K x is x: factors of a singular matrix exist, with a pivot of round-off."""
    known = np.cos(np.arange(len(indptr) - 1.0))  # no constant, no rigid motion
    found = solver.solve(symmetric_product(indptr, indices, data, known))
    return bool(norm(found - known) <= _ROUND_TRIP_ERROR * norm(known))


def solver_threads() -> int:
    """Threads of one factorisation, by the environment's `DFTFS_SOLVER_THREADS`.

    Raises
    ------
    SolveError
        If it is no whole number from 1 to 256.
    """
    given = os.environ.get(_THREADS, "1")
    if not (given.isdecimal() and 1 <= int(given) <= _MOST_THREADS):
        raise SolveError(f"{_THREADS}={given!r} must be 1 to {_MOST_THREADS}, e.g. {_THREADS}=2")
    return int(given)


def _trim_heap() -> None:
    """Give back to the system what the C library keeps of freed memory (glibc only)."""
    with suppress(AttributeError, OSError, TypeError):
        ctypes.CDLL(None).malloc_trim(0)


def _pardiso_installed() -> bool:
    return importlib.util.find_spec("pypardiso") is not None


def _mkl() -> ctypes.CDLL:
    """MKL's single library, with as many threads as `solver_threads` says.

    Looked up in the file list of the installed mkl package; pypardiso's own search of the whole
    environment, half a second, only where that list is missing.
    """
    try:
        listed = importlib.metadata.files("mkl") or []
    except importlib.metadata.PackageNotFoundError:
        listed = []
    paths = [f.locate().resolve() for f in listed if "mkl_rt" in f.name]
    try:
        if paths:
            library = ctypes.CDLL(str(paths[0]))
        else:
            library = importlib.import_module("pypardiso").PyPardisoSolver().libmkl
    except (ImportError, OSError) as error:
        raise SolveError(f"PARDISO is not available ({error}); use the solver superlu") from None
    threads = solver_threads()
    library.MKL_Set_Threading_Layer(_SEQUENTIAL if threads == 1 else _INTEL_THREADS)
    if threads > 1:
        library.MKL_Set_Num_Threads(ctypes.c_int(threads))
    library.pardiso.argtypes = None
    library.pardiso.restype = None
    return library
