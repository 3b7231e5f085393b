"""Surfaces against each other and against themselves."""

import numpy as np
import pytest

import supple as sp
from supple.solvers.xpbd.contact.settings import XPBDContact
from supple.solvers.xpbd.solver import XPBD

SOFT = sp.StableNeoHookean(youngs=5e4, poisson=0.4, density=1000)


def inside_tets(points, x, tets, shrink=1e-9, vertices=None):
    """Number of the points (k, 3) inside a tet, from barycentric coordinates; without those of the points' vertices."""
    base = x[tets[:, 0]]
    inverse = np.linalg.inv(np.moveaxis(x[tets[:, 1:]] - base[:, None], 1, 2))
    b = np.einsum("tij,ktj->kti", inverse, points[:, None] - base)
    inside = (b > shrink).all(axis=2) & (b.sum(axis=2) < 1 - shrink)
    if vertices is not None:
        inside &= (tets != vertices[:, None, None]).all(axis=2)
    return int(inside.any(axis=1).sum())


def overlapping(frame):
    """Number of vertices of any body inside another one."""
    parts = frame.system.bodies
    x = frame.state.positions
    return sum(
        inside_tets(x[a.vertices], x[b.vertices], b.body.mesh.tets) for a in parts for b in parts if a.name != b.name
    )


def ball(name, position, velocity=(0, 0, 0), friction=0.0, edge=0.06):
    mesh = sp.shapes.sphere(radius=0.1, edge_length=edge)
    return sp.Body(name, mesh, SOFT, position=position, velocity=velocity, friction=friction)


@pytest.mark.parametrize("speed", [1.0, 4.0])
def test_thin_plates_do_not_pass_through_each_other(speed):
    def plate(name, y, v):
        return sp.Body(name, sp.shapes.box((0.2, 0.01, 0.2), (4, 1, 4)), SOFT, position=(0, y, 0), velocity=(0, v, 0))

    scene = sp.Scene([plate("a", -0.06, speed), plate("b", 0.06, -speed)], gravity=(0, 0, 0))
    for frame in sp.simulate(scene, XPBD(substeps=20), 1 / 60, 12):
        below, above = frame.positions["a"][:, 1].mean(), frame.positions["b"][:, 1].mean()
        assert below < above


def test_bodies_that_start_deep_inside_each_other_separate_slowly():
    scene = sp.Scene([ball("a", (0, 0, 0)), ball("b", (0.11, 0.02, 0.01))], gravity=(0, 0, 0))
    fastest, frame = 0.0, None
    for frame in sp.simulate(scene, XPBD(substeps=10, accuracy=0.9, start="push_out"), 1 / 60, 120):
        assert frame.report.status in ("intersecting", "energy_gained", "converged")
        fastest = max(fastest, np.abs(frame.state.velocities).max())
    assert overlapping(frame) == 0
    # Nothing takes the kinetic energy of parting again.
    assert frame.report.status in ("converged", "energy_gained")
    assert fastest < 2.0


def test_a_heap_comes_to_rest_without_overlaps():
    bodies = [ball(f"b{k}", (0.01 * k, 0.11 + 0.22 * k, -0.007 * k), friction=0.4) for k in range(3)]
    room = sp.obstacles.Box(center=(0, 1, 0), size=(0.25, 2, 0.25), inside=True, friction=0.4)
    frames = list(sp.simulate(sp.Scene(bodies, [room]), XPBD(substeps=10), 1 / 60, 60))
    for frame in frames[9::10]:
        assert overlapping(frame) == 0
    heights = sorted(p[:, 1].mean() for p in frames[-1].positions.values())
    assert np.diff(heights).min() > 0.1
    assert min(f.report.details.smallest_gap or 0.0 for f in frames) > -1e-4


def arch(name="arch"):
    """A U of soft material, open at the top."""
    mesh = sp.shapes.box((0.3, 0.03, 0.05), (24, 2, 2))
    x = mesh.vertices.copy()
    radius = 0.3 / (2 * np.pi) * 1.15
    angle = x[:, 0] / radius
    bent = np.stack([(radius - x[:, 1]) * np.sin(angle), -(radius - x[:, 1]) * np.cos(angle), x[:, 2]], axis=1)
    return sp.Body(name, sp.TetMesh(bent, mesh.tets), SOFT, position=(0, 0.07, 0))


def crossing_of_legs(frame):
    """Largest distance of the left leg's end beyond the right leg's end [m]."""
    body = frame.system.bodies[0].body
    rest = body.mesh.vertices
    left, right = (rest[:, 1] > 0.0) & (rest[:, 0] < 0), (rest[:, 1] > 0.0) & (rest[:, 0] > 0)
    x = frame.state.positions[:, 0]
    return x[left].max() - x[right].min()


@pytest.mark.parametrize("enabled", [True, False])
def test_the_legs_of_a_bent_beam_meet_and_do_not_cross(enabled):
    body = arch()
    squeeze = [
        sp.HalfSpace(point=(-0.07, 0, 0), normal=(1, 0, 0), motion=lambda t: (min(0.2 * t, 0.036), 0, 0)),
        sp.HalfSpace(point=(0.07, 0, 0), normal=(-1, 0, 0), motion=lambda t: (-min(0.2 * t, 0.036), 0, 0)),
    ]
    scene = sp.Scene([body], squeeze, gravity=(0, 0, 0))
    solver = XPBD(substeps=40, accuracy=0.9, contact=XPBDContact(self_collision=enabled))
    worst, crossed = -1.0, 0
    for frame in sp.simulate(scene, solver, 1 / 60, 24):
        assert frame.report.status in ("converged", "intersecting")
        worst = max(worst, crossing_of_legs(frame))
        tets, x = body.mesh.tets, frame.state.positions
        surface = np.unique(body.mesh.surface.triangles)
        crossed = max(crossed, inside_tets(x[surface], x, tets, 1e-3, surface))
    assert (crossed == 0) == enabled


def test_a_body_at_rest_has_no_contact_with_itself():
    for mesh in (sp.shapes.torus(radius=0.1, tube_radius=0.03, edge_length=0.025), arch().mesh):
        scene = sp.Scene([sp.Body("b", mesh, SOFT, angular_velocity=(3, 2, 1))], gravity=(0, 0, 0))
        with_contact = list(sp.simulate(scene, XPBD(substeps=5), 1 / 60, 10))[-1]
        without = list(sp.simulate(scene, XPBD(substeps=5, contact=None), 1 / 60, 10))[-1]
        assert with_contact.report.details.contacts == 0
        assert (with_contact.state.positions == without.state.positions).all()


def test_contact_settings_decide_whether_a_body_passes_a_pinned_one():
    scene = sp.Scene(
        [ball("a", (-0.12, 0, 0), (3, 0, 0)), ball("b", (0.12, 0, 0))],
        pins=[sp.Pin("b", np.arange(len(ball("b", (0, 0, 0)).mesh.vertices)))],
        gravity=(0, 0, 0),
    )
    fixed = scene.bodies[1].place(scene.bodies[1].mesh.vertices)
    for contact, passes in (
        (XPBDContact(), False),
        (XPBDContact(thickness=0.004), False),
        (XPBDContact(body_collision=False), True),
        (None, True),
    ):
        frame = list(sp.simulate(scene, XPBD(substeps=10, contact=contact), 1 / 60, 12))[-1]
        assert (frame.positions["a"][:, 0].mean() > 0.1) == passes
        assert (frame.positions["b"] == fixed).all()
