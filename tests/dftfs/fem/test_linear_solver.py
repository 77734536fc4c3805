"""Every linear solver gives the same answer, and a singular matrix is reported."""

import importlib.util

import numpy as np
import pytest
from scipy.sparse import csr_array, random_array, triu

from dftfs.errors import SolveError
from dftfs.fem import linear_solver
from dftfs.fem.linear_solver import make_solver, solver_threads
from dftfs.fem.sparse import preconditioned_cg, symmetric_product

HAS_PARDISO = importlib.util.find_spec("pypardiso") is not None
SOLVERS = ["superlu", *(["pardiso", "pardiso in blocks"] if HAS_PARDISO else [])]


def symmetric(n, shift, seed):
    """A sparse symmetric matrix, positive definite for a large shift."""
    half = random_array((n, n), density=0.05, rng=np.random.default_rng(seed))
    return csr_array(half + half.T + shift * csr_array(np.eye(n)))


def upper(matrix):
    part = csr_array(triu(matrix))
    part.sort_indices()
    return part.indptr.astype(np.int32), part.indices.astype(np.int32), part.data


@pytest.fixture
def name(request, monkeypatch):
    """A solver's name; PARDISO also as it takes large matrices."""
    if request.param.endswith("in blocks"):
        monkeypatch.setattr(linear_solver, "BLOCKS_FROM", 0)
    return request.param.split()[0]


@pytest.mark.parametrize("name", SOLVERS, indirect=True)
class TestSolver:
    def test_solves_to_round_off_and_again_with_other_values(self, name):
        matrix = symmetric(120, 9.0, seed=1)
        indptr, indices, data = upper(matrix)
        solver = make_solver(indptr, indices, prefer=name)
        right = np.random.default_rng(2).normal(size=120)
        for scale in (1.0, -2.5, 40.0):
            assert solver.factorise(scale * data)
            solution = solver.solve(right)
            np.testing.assert_allclose(scale * (matrix @ solution), right, atol=1e-11)
        solver.close()

    def test_counts_negative_pivots_as_there_are_negative_eigenvalues(self, name):
        matrix = symmetric(60, 0.7, seed=4)
        negative = np.count_nonzero(np.linalg.eigvalsh(matrix.toarray()) < 0)
        assert 3 < negative < 57
        indptr, indices, data = upper(matrix)
        solver = make_solver(indptr, indices, prefer=name)
        assert solver.factorise(data)
        right = np.arange(60.0)
        np.testing.assert_allclose(matrix @ solver.solve(right), right, atol=1e-9)
        if name == "pardiso":  # SuperLU's partial pivoting loses the inertia
            assert solver.negative_pivots == negative

    def test_tells_a_singular_matrix(self, name):
        """The Laplacian of a ring: constants are in its kernel."""
        n = 30
        ring = 2 * np.eye(n) - np.roll(np.eye(n), 1, axis=0) - np.roll(np.eye(n), -1, axis=0)
        indptr, indices, data = upper(csr_array(ring))
        solver = make_solver(indptr, indices, prefer=name)
        assert not solver.factorise(data)
        data[indptr[:-1]] += 1e-3
        assert solver.factorise(data)

    def test_refuses_values_that_are_not_finite(self, name):
        indptr, indices, data = upper(symmetric(20, 5.0, seed=5))
        data[3] = np.nan
        assert not make_solver(indptr, indices, prefer=name).factorise(data)


def test_product_with_the_upper_triangle_is_that_with_the_matrix():
    matrix = symmetric(80, -3.0, seed=3)
    x = np.random.default_rng(4).normal(size=80)
    np.testing.assert_allclose(symmetric_product(*upper(matrix), x), matrix @ x, atol=1e-13)


def test_unknown_name_is_refused():
    indptr, indices, _ = upper(symmetric(10, 5.0, seed=6))
    with pytest.raises(SolveError, match="solver 'lapack' is unknown; allowed: auto, pardiso"):
        make_solver(indptr, indices, prefer="lapack")


def test_superlu_is_the_fallback_where_pardiso_is_missing(monkeypatch):
    found = importlib.util.find_spec
    monkeypatch.setattr(
        "importlib.util.find_spec", lambda name: None if name == "pypardiso" else found(name)
    )
    indptr, indices, _ = upper(symmetric(10, 5.0, seed=7))
    assert make_solver(indptr, indices).name == "superlu"


def test_conjugate_gradients_finish_from_the_factors_of_a_neighbour():
    near, exact = symmetric(150, 9.0, seed=8), symmetric(150, 9.0, seed=8)
    exact.data *= 1 + 1e-3 * np.random.default_rng(9).uniform(-1, 1, exact.nnz)
    exact = csr_array((exact + exact.T) / 2)
    indptr, indices, data = upper(near)
    solver = make_solver(indptr, indices)
    assert solver.factorise(data)
    right = np.random.default_rng(10).normal(size=150)
    solution = preconditioned_cg(lambda x: exact @ x, solver.solve, right, tolerance=1e-10)
    np.testing.assert_allclose(exact @ solution, right, atol=1e-9)


def test_conjugate_gradients_give_up_on_factors_too_far_off():
    near, other = symmetric(150, 9.0, seed=11), symmetric(150, 9.0, seed=12)
    indptr, indices, data = upper(near)
    solver = make_solver(indptr, indices)
    solver.factorise(data)
    right = np.ones(150)
    assert (
        preconditioned_cg(
            lambda x: other @ x, solver.solve, right, tolerance=1e-12, max_iterations=3
        )
        is None
    )


def test_the_number_of_threads_is_the_environments_and_checked(monkeypatch):
    monkeypatch.delenv("DFTFS_SOLVER_THREADS", raising=False)
    assert solver_threads() == 1
    monkeypatch.setenv("DFTFS_SOLVER_THREADS", "2")
    assert solver_threads() == 2
    for wrong in ("0", "two", "-1"):
        monkeypatch.setenv("DFTFS_SOLVER_THREADS", wrong)
        with pytest.raises(SolveError, match="DFTFS_SOLVER_THREADS=2"):
            solver_threads()
