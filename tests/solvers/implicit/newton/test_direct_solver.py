"""Direct solvers: each factorization solves, and its steps are those by conjugate gradients."""

import os

import numpy as np
import pytest

import supple as sp
from supple.numerics.sparse.block_csr import build_pattern
from supple.solvers.implicit.newton import direct_solver


def _step(linear_solver: str) -> np.ndarray:
    mesh = sp.shapes.box(size=(0.4, 0.1, 0.1), divisions=(4, 1, 1))
    body = sp.Body("bar", mesh, sp.StableNeoHookean(youngs=1e5, poisson=0.4))
    held = sp.Pin("bar", sp.InBox((-0.21, -1, -1), (-0.19, 1, 1)))
    scene = sp.Scene([body], pins=[held])
    frame = list(sp.simulate(scene, sp.Implicit(linear_solver=linear_solver), dt=1 / 60, steps=3))[-1]
    assert frame.report.status == "converged"
    return frame.positions["bar"]


def test_superlu_and_conjugate_gradients_agree(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(direct_solver, "_pardiso", lambda: None)
    np.testing.assert_allclose(_step("direct"), _step("pcg"), atol=1e-7)


def test_pardiso_and_superlu_agree(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("pypardiso")
    with_pardiso = _step("direct")
    monkeypatch.setattr(direct_solver, "_pardiso", lambda: None)
    np.testing.assert_allclose(with_pardiso, _step("direct"), atol=1e-9)


@pytest.mark.parametrize("factorization", ["pardiso", "superlu"])
@pytest.mark.parametrize(("integrator", "dt"), [("backward_euler", 0.25), ("static", 1.0)])
def test_a_bar_that_buckles_converges_with_a_factorization(factorization, integrator, dt, monkeypatch) -> None:
    """Pressed to 40 % of its length, the straight bar is a saddle: its true Hessian has negative eigenvalues."""
    if factorization == "pardiso":
        pytest.importorskip("pypardiso")
    else:
        monkeypatch.setattr(direct_solver, "_pardiso", lambda: None)
    mesh = sp.shapes.box((1, 0.25, 0.25), (8, 2, 2))
    x = mesh.vertices[:, 0]
    press = sp.Keyframes(times=[0, 4 * dt], displacements=[[0, 0, 0], [-0.6, 0, 0]])
    body = sp.Body("bar", mesh, sp.StableNeoHookean(youngs=1e5, poisson=0.45))
    ends = [sp.Pin("bar", np.flatnonzero(x == x.min())), sp.Pin("bar", np.flatnonzero(x == x.max()), press)]
    scene = sp.Scene([body], pins=ends, gravity=(0, -0.1, 0))
    solver = sp.Implicit(contact=None, linear_solver="direct", max_substeps=1, integrator=integrator)
    frames = list(sp.simulate(scene, solver, dt, 4))
    assert [frame.report.status for frame in frames] == ["converged"] * 4
    middle = np.abs(x) < 1e-12
    sideways = frames[-1].positions["bar"][middle].mean(axis=0)[1:]
    assert np.linalg.norm(sideways) > 0.1, "it has left the saddle"


@pytest.mark.parametrize("factorization", ["pardiso", "superlu"])
def test_vectors_over_all_rows_are_added_to_a_factorization(factorization, monkeypatch) -> None:
    """An indefinite matrix that one vector makes definite, and another one does not."""
    if factorization == "pardiso":
        pytest.importorskip("pypardiso")
    else:
        monkeypatch.setattr(direct_solver, "_pardiso", lambda: None)
    pattern = build_pattern(np.array([[0, 1, 2, 3]], dtype=np.int32), 4)
    rng = np.random.default_rng(3)
    root = rng.normal(size=(12, 12))
    values, vectors = np.linalg.eigh(root @ root.T + 12.0 * np.eye(12))
    values[0] = -1.0
    dense = vectors * values @ vectors.T
    rows = np.repeat(np.arange(4), np.diff(pattern.row_start))
    data = np.stack([dense[3 * i : 3 * i + 3, 3 * j : 3 * j + 3] for i, j in zip(rows, pattern.columns, strict=True)])
    b = np.arange(12.0).reshape(4, 3)
    enough = np.stack([3.0 * vectors[:, 0], rng.normal(size=12)]).reshape(2, 4, 3)
    solved = direct_solver.solve_directly(pattern, np.ascontiguousarray(data), b, True, enough)
    assert solved is not None
    G = enough.reshape(2, -1).T
    np.testing.assert_allclose((dense + G @ G.T) @ solved.ravel(), b.ravel(), atol=1e-9)
    for too_little in (direct_solver.NOTHING_MORE, 0.9 * vectors[:, 0].reshape(1, 4, 3)):
        assert direct_solver.solve_directly(pattern, np.ascontiguousarray(data), b, True, too_little) is None


def test_the_library_of_pardiso_is_found_without_a_search(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("pypardiso")
    library = direct_solver.mkl_library()
    if library is None:
        pytest.skip("MKL is not a package of pip here")
    monkeypatch.delenv("PYPARDISO_MKL_RT", raising=False)
    monkeypatch.setattr("glob.glob", lambda *_, **__: pytest.fail("pypardiso searches the environment"))
    assert direct_solver._pardiso.__wrapped__() is not None
    assert "PYPARDISO_MKL_RT" not in os.environ
