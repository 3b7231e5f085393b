"""Random drops of shells, soft and rigid bodies in `Implicit` with its defaults: nothing crosses anything."""

import numpy as np
import pytest
from tests.solvers.implicit.contact.test_shell_contact import sheet

import supple as sp
from supple.results.check.report import Verdict

QUICK, ALL = 2, 30
# Of `supple check`: a step that does not converge says so.
EXACT = ("finite", "inversion", "intersection", "tunnelling", "obstacles", "containment", "records")


def _surface(rng, size):
    """A flat sheet, a sheet that is curved at rest, or a closed surface."""
    kind = rng.integers(3)
    if kind == 2:
        return sp.shapes.sphere(radius=0.5 * size, edge_length=0.3 * size).surface.compact()
    cells = tuple(rng.integers(3, 9, 2))
    flat = sheet(cells, (size, size * rng.uniform(0.4, 1.0)))
    if kind == 0:
        return flat
    x = flat.vertices.copy()
    radius = size * rng.uniform(0.4, 1.0)
    angle = x[:, 0] / radius
    x[:, 0], x[:, 1] = radius * np.sin(angle), radius * np.cos(angle)
    return sp.SurfaceMesh(x, flat.triangles)


def drop(seed):
    """Two or three shells, a soft and a rigid body above each other, over a floor or a ball."""
    rng = np.random.default_rng(seed)
    size = 10.0 ** rng.uniform(-2.0, 0.0)
    kinds = rng.permutation(["shell"] * rng.integers(2, 4) + ["soft", "rigid"])
    bodies, height = [], 0.3 * size
    for k, kind in enumerate(kinds):
        turned = {
            "position": (*(0.15 * size * rng.normal(size=1)), height + 0.9 * size, *(0.15 * size * rng.normal(size=1))),
            "rotation": 2.0 * rng.normal(size=3),
            "velocity": (0.0, -rng.uniform(0.0, 3.0) * size**0.5, 0.0),
            "angular_velocity": rng.normal(size=3),
            "friction": rng.uniform(0.0, 0.8),
        }
        height += 1.7 * size
        name, youngs = f"{kind} {k}", 10.0 ** rng.uniform(4.5, 8.0)
        if kind == "shell":
            material = sp.ShellMaterial(
                youngs=youngs,
                poisson=rng.uniform(0.0, 0.5),
                thickness=size * 10.0 ** rng.uniform(-2.7, -1.7),
                density=10.0 ** rng.uniform(2.3, 3.3),
                membrane=("neo_hookean", "st_venant_kirchhoff")[rng.integers(2)],
                damping=0.01 * rng.integers(2),
            )
            bodies.append(sp.Shell(name, _surface(rng, size), material, **turned))
        elif kind == "soft":
            cube = sp.shapes.box(size=(0.5 * size,) * 3, divisions=(2, 2, 2))
            bodies.append(sp.Body(name, cube, sp.StableNeoHookean(youngs=youngs, poisson=0.4), **turned))
        else:
            shape = sp.shapes.box(size=size * rng.uniform(0.1, 0.6, 3)).surface
            bodies.append(sp.RigidBody(name, shape, density=10.0 ** rng.uniform(2.5, 3.9), **turned))
    ground = sp.HalfSpace() if rng.random() < 0.6 else sp.Sphere(center=(0.0, -0.5 * size, 0.0), radius=0.5 * size)
    return sp.Scene(bodies, obstacles=[ground])


@pytest.mark.parametrize(
    "seed", [*range(QUICK), *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(QUICK, ALL))]
)
def test_random_drops_cross_nothing(seed, tmp_path):
    scene, path = drop(seed), tmp_path / "drop.vtkhdf"
    for _ in sp.simulate(scene, sp.Implicit(), dt=1 / 60, steps=8 if seed < QUICK else 40, sinks=[sp.Recorder(path)]):
        pass
    report = sp.check_recording(path)
    failed = {one.name: one.message for one in report.results if one.verdict is Verdict.FAIL}
    assert not failed.keys() & set(EXACT), failed
