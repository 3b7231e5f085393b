"""Contact of shells in `Implicit`: they keep the distance of their thickness, and pass through nothing."""

from dataclasses import replace

import ipctk
import numpy as np
import pytest

import supple as sp
from supple.contact.mesh.contact_mesh import mesh_of_triangles
from supple.errors import SolverError
from supple.numerics.geometry.embedded_points import EmbeddedPoints
from supple.numerics.geometry.triangle_crossings import crossing_triangles

T = 2e-3
CLOTH = sp.ShellMaterial(youngs=2e5, poisson=0.3, thickness=T, density=400.0, damping=0.01)


def sheet(cells, size, middle=(0.0, 0.0, 0.0)):
    """A rectangle in a plane y = const., squares cut along both diagonals in turns."""
    (nx, nz), (length, width) = cells, size
    i, j = (axis.ravel() for axis in np.meshgrid(np.arange(nx + 1), np.arange(nz + 1), indexing="ij"))
    triangles = []
    for row in range(nx):
        for column in range(nz):
            a = row * (nz + 1) + column
            b, c, d = a + nz + 1, a + nz + 2, a + 1
            triangles += [[a, c, b], [a, d, c]] if (row + column) % 2 else [[a, d, b], [b, d, c]]
    x = np.column_stack([length * (i / nx - 0.5), np.zeros(len(i)), width * (j / nz - 0.5)])
    return sp.SurfaceMesh(x + middle, triangles)


def crossings(scene, frame):
    """How many pairs of triangles of bodies cross, by the exact test."""
    points, triangles, owner = [], [], []
    for k, body in enumerate(scene.bodies):
        one = (body if isinstance(body, sp.Shell) else body.mesh).surface.triangles
        triangles.append(one + sum(map(len, points)))
        points.append(frame.positions[body.name])
        owner.append(np.full(len(one), k))
    joined = np.concatenate(triangles).astype(np.int32), np.concatenate(owner).astype(np.int32)
    collide = np.ones((len(points), len(points)), dtype=np.bool_)
    return len(crossing_triangles(np.concatenate(points), *joined, collide, 1)[0])


def run(scene, steps, dt=1 / 60, integrator="backward_euler"):
    """The last frame, of which none crosses anything."""
    for frame in sp.simulate(scene, sp.Implicit(integrator=integrator), dt=dt, steps=steps):
        assert frame.report.status == "converged", frame.report.message
        assert crossings(scene, frame) == 0
    return frame


def nearest(points, x, triangles):
    """The smallest distance of points (k, 3) and triangles (f, 3) of points x (s, 3) [m]."""
    return np.sqrt(min(ipctk.point_triangle_distance(p, *x[t]) for p in points for t in triangles))


def test_layers_rest_at_their_thickness():
    layers = [
        sp.Shell("lower", sheet((4, 4), (0.2, 0.2)), CLOTH, position=(0.0, 0.55 * T, 0.0)),
        sp.Shell("upper", sheet((5, 5), (0.21, 0.19)), CLOTH, position=(0.0, 1.6 * T, 0.0)),
    ]
    last = run(sp.Scene(layers, obstacles=[sp.HalfSpace()]), 25)
    lower, upper = (last.positions[name][:, 1] for name in ("lower", "upper"))
    dhat = last.report.details.dhat
    assert dhat < 0.2 * T
    for y, middle, most in ((lower, 0.5 * T, 1.05 * dhat), (upper, 1.5 * T, 2.1 * dhat)):
        assert y.min() > middle
        assert y.max() < middle + most
    # The report says what is left beyond the thickness.
    assert 0.0 < last.report.min_distance < dhat
    assert last.report.min_distance == pytest.approx(min((lower - 0.5 * T).min(), last.report.min_distance))


@pytest.mark.parametrize(("cells", "thickness"), [(8, T), pytest.param(70, 5e-4, marks=pytest.mark.slow)])
@pytest.mark.parametrize(("friction", "rests"), [(0.5, True), (0.05, False)])
def test_cloth_on_a_ball_rests_or_slides_off(cells, thickness, friction, rests, tmp_path):
    radius, eccentric, path = 0.06, 0.02, tmp_path / "drape.vtkhdf"
    surface, place = sheet((cells, cells), (0.16, 0.16)), (eccentric, radius + 0.6 * thickness + 2e-4, 0.0)
    cloth = sp.Shell("cloth", surface, replace(CLOTH, thickness=thickness), position=place, friction=friction)
    ball = sp.Sphere(center=(0.0, 0.0, 0.0), radius=radius, friction=friction)
    *_, last = sp.simulate(sp.Scene([cloth], obstacles=[ball]), sp.Implicit(), 1 / 60, 45, sinks=[sp.Recorder(path)])
    assert not sp.check_recording(path).failures
    x = last.positions["cloth"]
    assert (x.mean(axis=0)[1] > 0.0) == rests
    if rests:
        assert np.linalg.norm(last.velocities["cloth"], axis=1).max() < 0.05
        # The ball consists of triangles; those of the cloth are chords, which touch it between the vertices.
        assert 0.99 * radius + 0.5 * thickness < np.linalg.norm(x, axis=1).min() < radius + 1.2 * thickness


@pytest.mark.parametrize(("friction", "holds"), [(0.8, True), (0.02, False)])
def test_plates_of_two_grippers_stretch_a_cloth_or_slip_off_it(friction, holds, tmp_path):
    thickness, path, plates = 1e-3, tmp_path / "grippers.vtkhdf", []
    gap = 0.5 * thickness + 3e-4

    def plate(along, above):
        def motion(time):  # closes, then pulls by 15 mm
            return (along * 0.015 * min(max(time - 0.1, 0.0) / 0.2, 1.0), -above * 2.6e-4 * min(time / 0.08, 1.0), 0.0)

        return sp.Box(
            center=(0.045 * along, above * (gap + 0.005), 0.0),
            size=(0.02, 0.01, 0.06),
            motion=motion,
            friction=friction,
        )

    plates = [plate(along, above) for along in (-1, 1) for above in (-1, 1)]
    material = sp.ShellMaterial(youngs=1e6, poisson=0.3, thickness=thickness, density=400.0, damping=0.01)
    cloth = sp.Shell("cloth", sheet((10, 3), (0.1, 0.03)), material, friction=friction)
    scene = sp.Scene([cloth], obstacles=plates)
    *_, last = sp.simulate(scene, sp.Implicit(), dt=1 / 60, steps=20, sinks=[sp.Recorder(path)])
    assert not sp.check_recording(path).failures
    stretch = np.ptp(last.positions["cloth"][:, 0]) - 0.1
    assert stretch > 0.028 if holds else stretch < 0.01


def test_folded_strip_keeps_its_thickness():
    """A strip that is bent to a U at rest, whose upper half falls on the lower one."""
    radius, n = 3.0 * T, 8
    flat = np.linspace(0.1, 0.0, 9)[:-1]
    angles = np.linspace(0.0, np.pi, n + 1)
    profile = np.concatenate(
        [
            np.column_stack([flat, np.zeros(len(flat))]),
            np.column_stack([-radius * np.sin(angles), radius * (1.0 - np.cos(angles))]),
            np.column_stack([flat[::-1], np.full(len(flat), 2.0 * radius)]),
        ]
    )
    strip = sheet((len(profile) - 1, 2), (1.0, 0.03))
    x = strip.vertices.copy()
    x[:, :2] = np.repeat(profile, 3, axis=0)
    shell = sp.Shell("strip", sp.SurfaceMesh(x, strip.triangles), CLOTH, position=(0.0, 0.6 * T, 0.0))
    last = run(sp.Scene([shell], obstacles=[sp.HalfSpace()], gravity=(0.0, -30.0, 0.0)), 12)
    y = last.positions["strip"][:, 1].reshape(-1, 3)
    gaps = y[-len(flat) :][::-1] - y[: len(flat)]
    assert T < gaps.min() < 1.3 * T


def test_soft_block_falls_on_a_pinned_cloth():
    surface = sheet((8, 8), (0.2, 0.2))
    ends = np.flatnonzero(np.abs(surface.vertices[:, 0]) > 0.0999)
    box = sp.shapes.box(size=(0.06, 0.06, 0.06), divisions=(2, 2, 2))
    block = sp.Body(
        "block",
        box,
        sp.NeoHookean(youngs=5e4, poisson=0.4, density=800.0),
        position=(0.0, 0.05, 0.0),
        velocity=(0.0, -1.0, 0.0),
    )
    last = run(sp.Scene([sp.Shell("cloth", surface, CLOTH), block], pins=[sp.Pin("cloth", ends)]), 20)
    cloth, block = last.positions["cloth"], last.positions["block"]
    assert 0.5 * T < nearest(block, cloth, surface.triangles) < 0.7 * T
    assert nearest(cloth, block, box.surface.triangles) > 0.5 * T
    assert block[:, 1].min() > -0.1


@pytest.mark.parametrize("integrator", ["backward_euler", "bdf2"])
def test_fast_cloth_passes_through_nothing(integrator):
    """At 10 m/s, a hundred times the thickness in a step."""
    cloth = sp.Shell("cloth", sheet((6, 6), (0.15, 0.15)), CLOTH, position=(0.0, 0.15, 0.0), velocity=(0.0, -10.0, 0.0))
    block = sp.Body(
        "block", sp.shapes.box(size=(0.05, 0.05, 0.05), divisions=(2, 2, 2)), sp.NeoHookean(youngs=1e5, poisson=0.4)
    )
    scene = sp.Scene([cloth, block], obstacles=[sp.HalfSpace(point=(0.0, -0.03, 0.0))])
    last = run(scene, 8, integrator=integrator)
    assert last.positions["cloth"][:, 1].min() > -0.03 + 0.5 * T


def test_shells_that_start_within_their_thickness_are_an_error():
    layers = [
        sp.Shell("lower", sheet((4, 4), (0.2, 0.2)), CLOTH),
        sp.Shell("upper", sheet((4, 4), (0.2, 0.2)), CLOTH, position=(0.0, 0.75 * T, 0.0)),
    ]
    text = "'lower' and body 'upper' are nearer at the start than the thickness of shells and rods, by 0.0005 m; move"
    with pytest.raises(SolverError, match=text):
        run(sp.Scene(layers), 1)
    with pytest.raises(SolverError, match=r"body 'lower' and obstacle.*nearer at the start.*by 0.0002 m"):
        run(sp.Scene(layers[:1], obstacles=[sp.HalfSpace(point=(0.0, -0.4 * T, 0.0))]), 1)
    # What is stitched touches beside its stitches, too.
    stitch = sp.SoftVertexTriangleStitch("upper", "lower", max_distance=T, youngs=1e5, poisson=0.3)
    with pytest.raises(SolverError, match=text):
        run(sp.Scene(layers, stitches=[stitch]), 1)


def test_closed_shell_contains_a_body():
    surface = sp.shapes.box(size=(0.1, 0.1, 0.1), divisions=(3, 3, 3)).surface.compact()
    bag = sp.Shell("bag", surface, CLOTH)
    inner = sp.shapes.box(size=(0.04, 0.04, 0.04), divisions=(1, 1, 1))
    block = sp.Body("block", inner, sp.NeoHookean(youngs=1e5, poisson=0.4))
    last = run(sp.Scene([bag, block], gravity=(0.0, 0.0, 0.0)), 1)
    np.testing.assert_allclose(last.positions["block"].mean(axis=0), 0.0, atol=1e-3)


def test_what_is_near_along_a_surface_does_not_collide_and_layers_do():
    flat, above = sheet((10, 2), (0.1, 0.02)), sheet((10, 2), (0.1, 0.02), (0.0, 0.011, 0.0))
    x = np.concatenate([flat.vertices, above.vertices])
    triangles = np.concatenate([flat.triangles, above.triangles + len(flat.vertices)]).astype(np.int32)
    owner = np.zeros(len(x), dtype=np.int32)
    more = {"body_count": 1, "names": ("one",), "collide": np.ones((1, 1), dtype=np.bool_)}
    points = EmbeddedPoints.at_vertices(np.arange(len(x), dtype=np.int32))
    mesh = mesh_of_triangles(points, triangles, owner, x, offsets=np.full(len(x), 0.006), **more)
    lists = [
        {(i, j) for i in range(len(one.start) - 1) for j in one.items[one.start[i] : one.start[i + 1]]}
        for one in mesh.near_at_rest
    ]
    middles = x[triangles].mean(axis=1)
    assert all((abs(x[i, 1] - middles[j, 1]) < 1e-9) for i, j in lists[0])
    assert all((x[mesh.edges[i, 0], 1] == x[mesh.edges[j, 0], 1]) for i, j in lists[1])
    # A triangle two cells away is nearer than 18 mm, one three cells away is not.
    assert {abs(round((x[i, 0] - middles[j, 0]) / 0.01, 1)) <= 2.4 for i, j in lists[0]} == {True}
    assert len(lists[0]) > 10 * len(flat.vertices)
    assert all((j, i) in lists[1] for i, j in lists[1])
