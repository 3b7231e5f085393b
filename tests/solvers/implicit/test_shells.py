"""Shells in `Implicit`: closed forms of plates, beams and balloons on meshes of several directions; what is refused."""

import numpy as np
import pytest

import supple as sp
from supple.errors import SceneError, SolverError

STATIC = sp.Implicit(integrator="static", contact=None)


def sheet(cells, size, kind="right", seed=0):
    """A rectangle in the plane y = 0: squares cut along one diagonal or both in turns; "random" moves inner vertices
    beyond the second column."""
    (nx, nz), (length, width) = cells, size
    i, j = (axis.ravel() for axis in np.meshgrid(np.arange(nx + 1), np.arange(nz + 1), indexing="ij"))
    x, z = i / nx, j / nz
    if kind == "random":
        inside = (i > 1) & (i < nx) & (j > 0) & (j < nz)
        moves = np.random.default_rng(seed).uniform(-0.3, 0.3, (2, len(x))) * inside
        x, z = x + moves[0] / nx, z + moves[1] / nz
    triangles = []
    for row in range(nx):
        for column in range(nz):
            a = row * (nz + 1) + column
            b, c, d = a + nz + 1, a + nz + 2, a + 1
            one = kind == "right" or (kind == "jack" and (row + column) % 2)
            triangles += [[a, c, b], [a, d, c]] if one else [[a, d, b], [b, d, c]]
    return sp.SurfaceMesh(np.column_stack([length * x, np.zeros(len(x)), width * z]), triangles)


def border(surface):
    x = surface.vertices[:, [0, 2]]
    return np.flatnonzero((np.isclose(x, x.min(axis=0)) | np.isclose(x, x.max(axis=0))).any(axis=1))


def at_rest(scene, solver=STATIC, steps=1):
    *_, last = sp.simulate(scene, solver, dt=1.0 / steps, steps=steps)
    assert last.report.status == "converged"
    return last


@pytest.mark.parametrize("kind", ["right", "left", "jack", "random"])
def test_plate_under_its_weight_bends_as_that_of_kirchhoff_whatever_the_direction_of_its_mesh(kind):
    # Timoshenko, Woinowsky-Krieger (1959), table 8: a square plate whose edges turn freely, w = .00406 q a^4 / D.
    surface, t, density = sheet((20, 20), (1.0, 1.0), kind), 0.01, 1000.0
    material = sp.ShellMaterial(youngs=1e7, poisson=0.3, thickness=t, density=density)
    wanted = 1e-3 * t
    g = wanted * material.bending_stiffness / (0.00406235 * density * t)
    shell = sp.Shell("plate", surface, material)
    scene = sp.Scene([shell], pins=[sp.Pin("plate", border(surface))], gravity=(0.0, -g, 0.0))
    assert -at_rest(scene).positions["plate"][:, 1].min() == pytest.approx(wanted, rel=0.02)


def cantilever(load, kind, cells=(20, 2), steps=1):
    """The tip of a strip that is clamped at x = 0 and carries P L^2 / (E I) = load: its place along x and y over L."""
    length, width, t, youngs = 1.0, 0.1, 0.01, 1e7
    h = length / cells[0]
    surface = sheet((cells[0] + 1, cells[1]), (length + h, width), kind).transformed(translation=(-h, 0.0, 0.0))
    x = surface.vertices[:, 0]
    root, tip = np.flatnonzero(x < 1e-9), np.flatnonzero(x > length - 1e-9)
    total = load * youngs * width * t**3 / 12.0 / length**2
    weights = np.ones(len(tip))
    weights[[0, -1]] = 0.5

    def force(time):
        return np.outer(weights / weights.sum(), (0.0, -total * min(time, 1.0), 0.0))

    material = sp.ShellMaterial(youngs=youngs, poisson=0.0, thickness=t, membrane="st_venant_kirchhoff")
    scene = sp.Scene(
        [sp.Shell("strip", surface, material)],
        pins=[sp.Pin("strip", root)],
        loads=[sp.Force("strip", tip, force)],
        gravity=(0.0, 0.0, 0.0),
    )
    return at_rest(scene, steps=steps).positions["strip"][tip].mean(axis=0)[:2] / length


@pytest.mark.parametrize("kind", ["right", "jack", "random"])
def test_cantilever_bends_as_that_of_euler_and_bernoulli(kind):
    assert -cantilever(1e-2, kind)[1] == pytest.approx(1e-2 / 3.0, rel=0.01)


@pytest.mark.parametrize("kind", ["right", "jack"])
def test_strip_is_an_elastica(kind):
    # Mattiasson (1981), table 1, at P L^2 / (E I) = 10.
    x, y = cantilever(10.0, kind, steps=5)
    assert -y == pytest.approx(0.81061, rel=0.01)
    assert 1.0 - x == pytest.approx(0.55500, rel=0.01)


def test_roof_of_scordelis_and_lo():
    # MacNeal, Harder (1985): the middle of the free edge sinks by .3024; a thousandth of the load, where it is linear.
    flat, share = sheet((44, 44), (1.0, 1.0), "jack"), 1e-3
    u = flat.vertices
    angle = np.deg2rad(80.0) * (u[:, 0] - 0.5)
    x = np.column_stack([25.0 * np.sin(angle), 25.0 * np.cos(angle), 50.0 * u[:, 2]])
    ends, middle = np.flatnonzero(np.isclose(np.abs(u[:, 2] - 0.5), 0.5)), np.isclose(u[:, 2], 0.5)
    material = sp.ShellMaterial(youngs=4.32e8, poisson=0.0, thickness=0.25, density=1000.0)
    scene = sp.Scene(
        [sp.Shell("roof", sp.SurfaceMesh(x, flat.triangles), material)],
        gravity=(0.0, -90.0 * share / 250.0, 0.0),
        loads=[
            sp.SoftTarget("roof", ends, (1e9, 1e9, 0.0)),
            sp.SoftTarget("roof", np.flatnonzero(middle & np.isclose(u[:, 0], 0.5)), (0.0, 0.0, 1.0)),
        ],
    )
    edge = middle & (u[:, 0] == 0.0)
    sunk = (x - at_rest(scene).positions["roof"])[edge, 1][0]
    assert sunk / share == pytest.approx(0.3024, rel=0.03)


def test_rubber_balloon_has_the_pressure_of_its_closed_form():
    # Of an incompressible neo-Hookean membrane: p = 2 t mu / R (1 / s - 1 / s^7) at the stretch s.
    radius, t, youngs, stretch = 0.1, 1e-3, 1e6, 1.3
    surface = sp.shapes.sphere(radius=radius, edge_length=0.02).surface.compact()
    radius = (surface.volume / (4.0 / 3.0 * np.pi)) ** (1.0 / 3.0)
    pressure = 2.0 * t * youngs / 3.0 / radius * (1.0 / stretch - stretch**-7)
    material = sp.ShellMaterial(youngs=youngs, poisson=0.5, thickness=t)
    # Where it crosses the axes nearest, it may move along these alone, so that it cannot fly away or turn.
    held = [
        sp.SoftTarget("balloon", [int(np.argmax(side * surface.vertices[:, axis]))], 1e2 * (np.arange(3) != axis))
        for axis in range(3)
        for side in (1.0, -1.0)
    ]
    scene = sp.Scene(
        [sp.Shell("balloon", surface, material)],
        loads=[sp.Pressure("balloon", lambda time: -pressure * time), *held],
        gravity=(0.0, 0.0, 0.0),
    )
    end = sp.SurfaceMesh(at_rest(scene).positions["balloon"], surface.triangles)
    assert (end.volume / surface.volume) ** (1.0 / 3.0) == pytest.approx(stretch, rel=0.01)


def cloth(**more):
    surface = sheet((8, 8), (0.4, 0.4), "jack")
    material = sp.ShellMaterial(youngs=1e6, poisson=0.3, thickness=1e-3, density=500.0, damping=0.01)
    pins = [sp.Pin("cloth", np.flatnonzero(surface.vertices[:, 0] == 0.0))]
    return sp.Scene([sp.Shell("cloth", surface, material)], **{"pins": pins} | more)


def test_recording_of_a_shell_passes_all_checks_of_its_energy_and_works(tmp_path):
    path = tmp_path / "cloth.vtkhdf"
    scene = cloth(loads=[sp.Wind("cloth", (0.0, -5.0, 3.0)), sp.Pressure("cloth", 1.0)])
    solver = sp.Implicit(integrator="bdf2", contact=None)
    frames = list(sp.simulate(scene, solver, dt=1 / 60, steps=5, sinks=[sp.Recorder(path, compress=True)]))
    assert frames[-1].report.elastic_energy > 0.0
    recording = sp.read_recording(path)
    np.testing.assert_array_equal(recording[5].positions["cloth"], frames[-1].positions["cloth"])
    report = recording.check()
    assert report.ok, str(report)
    # The check has its own sums of membrane and bending, by turns of edges instead of moments.
    assert "records: agree within" in str(report)
    assert "balance: works close" in str(report)
    recording.export("vtu", tmp_path / "last.vtu")


def test_check_finds_a_body_that_passes_through_a_shell(tmp_path):
    path, shape = tmp_path / "through.vtkhdf", sp.shapes.box(size=(0.05, 0.05, 0.05), divisions=(1, 1, 1))
    ball = sp.Body("ball", shape, sp.StableNeoHookean(youngs=1e5, poisson=0.3), position=(0.2, 0.03, 0.2))
    scene = cloth(gravity=(0.0, 0.0, 0.0))
    scene = scene.with_added(bodies=[ball.changed(velocity=(0.0, -20.0, 0.0))])
    list(sp.simulate(scene, sp.Implicit(contact=None), dt=1 / 60, steps=2, sinks=[sp.Recorder(path)]))
    assert "fail  tunnelling" in str(sp.read_recording(path).check())


def test_free_shell_keeps_its_momentum_and_its_spin():
    scene = cloth(pins=[], gravity=(0.0, 0.0, 0.0))
    body = scene.bodies[0].changed(velocity=(1.0, 0.0, 0.0), angular_velocity=(3.0, 2.0, 1.0))
    scene = sp.Scene([body], gravity=(0.0, 0.0, 0.0))
    solver = sp.Implicit(integrator="bdf2", contact=None, tolerance=1e-6)
    first, *_, last = sp.simulate(scene, solver, dt=1 / 240, steps=20)
    mass = 500.0 * 1e-3 * 0.16
    np.testing.assert_allclose(last.report.linear_momentum, (mass, 0.0, 0.0), atol=1e-9)
    np.testing.assert_allclose(last.report.angular_momentum, first.report.angular_momentum, rtol=1e-2)


@pytest.mark.parametrize(
    ("solver", "text"),
    [
        (sp.Implicit(contact=None, integrator="newmark"), "newmark.*use 'bdf2'"),
    ],
)
def test_solvers_refuse_what_they_do_not_simulate_of_shells(solver, text):
    with pytest.raises(SolverError, match=text):
        list(sp.simulate(cloth(), solver, dt=1 / 60, steps=1))


def test_readings_and_loads_of_tets_are_refused():
    with pytest.raises(SceneError, match="shell 'cloth' has no tets"):
        cloth(loads=[sp.Growth("cloth", 1.1)])
    *_, last = sp.simulate(cloth(), sp.Implicit(contact=None), dt=1 / 60, steps=1)
    with pytest.raises(SceneError, match="body 'cloth' is a shell"):
        _ = last.stress["cloth"]
    with pytest.raises(SolverError, match="shells"):
        sp.modes(cloth(), 2)


@pytest.mark.parametrize(
    ("vertices", "triangles", "text"),
    [
        ([[0, 0, 0], [1, 0, 0], [0, 0, 1], [0, 1, 0], [0, -1, 1]], [[0, 1, 2], [1, 0, 3], [0, 1, 4]], "more than two"),
        ([[0, 0, 0], [1, 0, 0], [0, 0, 1], [1, 0, -1]], [[0, 1, 2], [0, 1, 3]], "face different ways"),
        ([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]], "triangle 0 .* has no area"),
        ([[0, 0, 0], [1, 0, 0], [0, 0, 1], [5, 5, 5]], [[0, 1, 2]], "vertex 3 .*compact"),
    ],
)
def test_surfaces_that_are_no_shells_are_errors_that_name_the_place(vertices, triangles, text):
    with pytest.raises(SceneError, match=f"shell 'cloth': .*{text}"):
        sp.Shell(
            "cloth", sp.SurfaceMesh(vertices, triangles), sp.ShellMaterial(youngs=1e6, poisson=0.3, thickness=1e-3)
        )


@pytest.mark.parametrize("pinned", [[], [0], [0, 1, 2]])
def test_shell_of_one_triangle(tmp_path, pinned):
    surface = sp.SurfaceMesh([[0, 0, 0], [0, 0, 1], [1, 0, 0]], [[0, 1, 2]])
    shell = sp.Shell("one", surface, sp.ShellMaterial(youngs=1e6, poisson=0.3, thickness=1e-2, damping=0.1))
    scene = sp.Scene([shell], pins=[sp.Pin("one", pinned)] if pinned else [])
    sinks = [sp.Recorder(tmp_path / "one.vtkhdf")]
    *_, last = sp.simulate(scene, sp.Implicit(contact=None), dt=1 / 60, steps=3, sinks=sinks)
    assert last.report.status == "converged"
    report = sp.read_recording(tmp_path / "one.vtkhdf").check()
    assert report.ok, str(report)
