"""Shells in `XPBD`: the shapes of `Implicit`, energy, momentum, damping, contact at the distance of the thickness."""

import numpy as np
import pytest
from tests.solvers.implicit.contact.test_shell_contact import CLOTH, T, crossings, nearest
from tests.solvers.implicit.test_shells import sheet

import supple as sp
from supple.errors import SceneError
from supple.numerics.geometry.triangle_crossings import crossing_triangles

STATIC = sp.Implicit(integrator="static", contact=None)


def end(scene, solver, seconds=1.0, dt=1 / 60):
    *_, last = sp.simulate(scene, solver, dt=dt, steps=round(seconds / dt))
    return last


def statics():
    """A plate, a hanging sheet and a balloon, each with loads under which it changes its shape by much."""
    plate = sheet((8, 3), (1.0, 0.3), "jack")
    soft = {"thickness": 0.01, "density": 1000.0, "damping": 0.1}
    pins = [sp.Pin("one", np.flatnonzero(plate.vertices[:, 0] < 0.13))]
    beam = sp.Shell("one", plate, sp.ShellMaterial(youngs=1e8, poisson=0.3, **soft | {"damping": 0.03}))
    yield sp.Scene([beam], pins=pins, gravity=(0.0, -3.0, 0.0))
    top = [sp.Pin("one", np.flatnonzero(plate.vertices[:, 0] == 0.0))]
    for membrane in ("neo_hookean", "st_venant_kirchhoff"):
        material = sp.ShellMaterial(youngs=2e4, poisson=0.3, membrane=membrane, **soft)
        yield sp.Scene([sp.Shell("one", plate, material)], pins=top, gravity=(9.81, 0.0, 0.0))
    ball = sp.shapes.sphere(radius=0.1, edge_length=0.04).surface.compact()
    held = [sp.SoftTarget("one", np.arange(len(ball.vertices)), 1.0)]
    rubber = sp.ShellMaterial(youngs=1e6, poisson=0.5, thickness=1e-3, damping=0.02)
    loads = [sp.Pressure("one", lambda time: -2000.0 * min(1.0, 2.0 * time)), *held]
    yield sp.Scene([sp.Shell("one", ball, rubber)], loads=loads, gravity=(0.0, 0.0, 0.0))


@pytest.mark.parametrize(
    ("case", "substeps"),
    [(0, 120), (1, 16), (2, 16), (3, 200)],
    ids=["plate", "neo_hookean", "st_venant_kirchhoff", "balloon"],
)
def test_shells_come_to_rest_in_the_shapes_of_implicit(case, substeps):
    scene = list(statics())[case]
    rest = scene.bodies[0].surface.vertices
    wanted = end(scene, STATIC, 1.0, 0.5).positions["one"] - rest
    last = end(scene, sp.XPBD(substeps=substeps, contact=None, sleep_after=None), 2.5)
    size = np.abs(wanted).max()
    assert size > 0.005
    np.testing.assert_allclose(last.positions["one"] - rest, wanted, rtol=0.0, atol=0.03 * size)


@pytest.mark.parametrize("youngs", [1e3, 1e5, 1e7, 1e9])
@pytest.mark.parametrize("damping", [0.0, 0.1])
def test_free_sheet_gains_no_energy_and_keeps_its_momenta_from_random_velocities(youngs, damping):
    surface = sheet((6, 6), (0.5, 0.5), "random")
    material = sp.ShellMaterial(youngs=youngs, poisson=0.3, thickness=2e-3, density=300.0, damping=damping)
    scene = sp.Scene([sp.Shell("sheet", surface, material)], gravity=(0.0, 0.0, 0.0))
    velocities = {"sheet": np.random.default_rng(0).normal(size=surface.vertices.shape)}
    solver = sp.XPBD(substeps=40, contact=None, sleep_after=None)
    frames = list(sp.simulate(scene, solver, dt=1 / 60, steps=30, initial_velocities=velocities))
    energies = [frame.report.kinetic_energy + frame.report.elastic_energy for frame in frames]
    begun = 0.5 * scene.bodies[0].lumped_masses() @ (velocities["sheet"] ** 2).sum(axis=1)
    assert energies[-1] < 0.95 * begun
    assert max(energies[6:]) < 1.01 * max(energies[:6])
    for name in ("linear_momentum", "angular_momentum"):
        one, other = (getattr(frames[k].report, name) for k in (0, -1))
        np.testing.assert_allclose(other, one, rtol=1e-9, atol=1e-12)


def test_bending_oscillates_and_decays_as_in_implicit():
    surface = sheet((10, 2), (1.0, 0.2), "jack")
    pins = [sp.Pin("plate", np.flatnonzero(surface.vertices[:, 0] < 0.11))]
    material = sp.ShellMaterial(youngs=1e6, poisson=0.3, thickness=0.05, density=1000.0, damping=0.01)
    scene = sp.Scene([sp.Shell("plate", surface, material)], pins=pins, gravity=(0.0, -0.5, 0.0))
    tips = []
    for solver, dt in (
        (sp.XPBD(substeps=40, contact=None), 1 / 60),
        (sp.Implicit(integrator="bdf2", contact=None), 1 / 240),
    ):
        frames = list(sp.simulate(scene, solver, dt=dt, steps=round(1.2 / dt)))
        tips.append(
            np.array([frame.positions["plate"][-1, 1] for frame in frames])[
                round(1 / 60 / dt) - 1 :: round(1 / 60 / dt)
            ]
        )
    one, other = tips
    assert np.ptp(other) > 0.01
    np.testing.assert_allclose(one, other, rtol=0.0, atol=0.06 * np.ptp(other))


def run(scene, steps, solver=None):
    """The last frame, of which none crosses anything."""
    for frame in sp.simulate(scene, solver or sp.XPBD(), dt=1 / 60, steps=steps):
        assert frame.report.status == "converged", frame.report.message
        assert crossings(scene, frame) == 0
    return frame


def test_layers_rest_at_their_thickness():
    layers = [
        sp.Shell("lower", sheet((4, 4), (0.2, 0.2)), CLOTH, position=(0.0, 0.55 * T, 0.0)),
        sp.Shell("upper", sheet((5, 5), (0.2, 0.2)), CLOTH, position=(0.0, 1.6 * T, 0.0)),
    ]
    last = run(sp.Scene(layers, obstacles=[sp.HalfSpace()]), 30)
    lower, upper = (last.positions[name][:, 1] for name in ("lower", "upper"))
    np.testing.assert_allclose(lower, 0.5 * T, rtol=0.0, atol=0.01 * T)
    np.testing.assert_allclose(upper, 1.5 * T, rtol=0.0, atol=0.1 * T)
    assert -0.02 * T < last.report.details.smallest_gap < 0.05 * T


@pytest.mark.parametrize(("friction", "rests"), [(0.5, True), (0.05, False)])
def test_cloth_on_a_ball_rests_or_slides_off(friction, rests):
    radius, eccentric = 0.06, 0.02
    surface = sheet((8, 8), (0.16, 0.16)).transformed(translation=(eccentric - 0.08, 0.0, -0.08))
    cloth = sp.Shell("cloth", surface, CLOTH, position=(0.0, radius + 0.6 * T, 0.0), friction=friction)
    ball = sp.Sphere(center=(0.0, 0.0, 0.0), radius=radius, friction=friction)
    last = run(sp.Scene([cloth], obstacles=[ball]), 60)
    x = last.positions["cloth"]
    assert (x.mean(axis=0)[1] > 0.0) == rests
    if rests:
        assert np.linalg.norm(last.velocities["cloth"], axis=1).max() < 0.05
        assert 0.99 * radius + 0.5 * T < np.linalg.norm(x, axis=1).min() < radius + 1.2 * T


def test_soft_block_falls_on_a_pinned_cloth():
    surface = sheet((8, 8), (0.2, 0.2)).transformed(translation=(-0.1, 0.0, -0.1))
    ends = np.flatnonzero(np.abs(surface.vertices[:, 0]) > 0.0999)
    box = sp.shapes.box(size=(0.06, 0.06, 0.06), divisions=(2, 2, 2))
    rubber = sp.StableNeoHookean(youngs=5e4, poisson=0.4, density=800.0)
    block = sp.Body("block", box, rubber, position=(0.0, 0.05, 0.0), velocity=(0.0, -1.0, 0.0))
    last = run(sp.Scene([sp.Shell("cloth", surface, CLOTH), block], pins=[sp.Pin("cloth", ends)]), 20)
    cloth, block = last.positions["cloth"], last.positions["block"]
    assert 0.49 * T < nearest(block, cloth, surface.triangles) < 0.8 * T
    assert block[:, 1].min() > -0.1


def test_fast_cloth_passes_through_nothing():
    surface = sheet((6, 6), (0.15, 0.15)).transformed(translation=(-0.075, 0.0, -0.075))
    cloth = sp.Shell("cloth", surface, CLOTH, position=(0.0, 0.15, 0.0), velocity=(0.0, -10.0, 0.0))
    shape = sp.shapes.box(size=(0.05, 0.05, 0.05), divisions=(2, 2, 2))
    block = sp.Body("block", shape, sp.StableNeoHookean(youngs=1e5, poisson=0.4))
    scene = sp.Scene([cloth, block], obstacles=[sp.HalfSpace(point=(0.0, -0.03, 0.0))])
    for frame in sp.simulate(scene, sp.XPBD(), dt=1 / 60, steps=12):
        assert crossings(scene, frame) == 0
    assert frame.positions["cloth"][:, 1].min() > -0.03 + 0.49 * T


def test_closed_shell_contains_a_body():
    surface = sp.shapes.box(size=(0.1, 0.1, 0.1), divisions=(3, 3, 3)).surface.compact()
    inner = sp.shapes.box(size=(0.04, 0.04, 0.04), divisions=(1, 1, 1))
    block = sp.Body("block", inner, sp.StableNeoHookean(youngs=1e5, poisson=0.4))
    last = run(sp.Scene([sp.Shell("bag", surface, CLOTH), block], gravity=(0.0, 0.0, 0.0)), 2)
    np.testing.assert_allclose(last.positions["block"].mean(axis=0), 0.0, atol=1e-3)


def test_pin_carries_the_weight_of_a_hanging_sheet_and_the_recording_passes_all_checks(tmp_path):
    surface = sheet((4, 4), (0.2, 0.2), "jack")
    cloth = sp.Shell("cloth", surface, CLOTH)
    pin = sp.Pin("cloth", np.flatnonzero(surface.vertices[:, 0] == 0.0), name="rod")
    scene = sp.Scene([cloth], pins=[pin], gravity=(9.81, 0.0, 0.0))
    path = tmp_path / "cloth.vtkhdf"
    frames = list(sp.simulate(scene, sp.XPBD(), dt=1 / 60, steps=90, sinks=[sp.Recorder(path)]))
    weight = 9.81 * cloth.lumped_masses().sum()
    force = next(iter(frames[-1].report.details.reaction_forces.values()))
    np.testing.assert_allclose(force, (-weight, 0.0, 0.0), rtol=0.0, atol=0.03 * weight)
    report = sp.read_recording(path).check()
    assert report.ok, str(report)


def test_shells_that_start_within_their_thickness_are_an_error():
    layers = [
        sp.Shell("lower", sheet((4, 4), (0.2, 0.2)), CLOTH),
        sp.Shell("upper", sheet((4, 4), (0.2, 0.2)), CLOTH, position=(0.0, 0.75 * T, 0.0)),
    ]
    text = "body 'lower' and body 'upper' are nearer at the start than the thickness of shells, by 0.0005 m; move them"
    with pytest.raises(SceneError, match=text):
        run(sp.Scene(layers), 1)
    floor = sp.Scene(layers[:1], obstacles=[sp.HalfSpace(point=(0.0, -0.4 * T, 0.0))])
    with pytest.raises(SceneError, match=r"body 'lower' and obstacle.*nearer at the start.*by 0.0002 m"):
        run(floor, 1)
    assert run(floor, 2, sp.XPBD(start="push_out")).positions["lower"][:, 1].min() > -1e-9


def test_continued_run_has_the_bits_of_one_run():
    surface = sheet((4, 4), (0.2, 0.2), "jack")
    pins = [sp.Pin("cloth", np.flatnonzero(surface.vertices[:, 0] == 0.0))]
    scene = sp.Scene([sp.Shell("cloth", surface, CLOTH)], pins=pins, obstacles=[sp.HalfSpace(point=(0, -0.1, 0))])
    one = list(sp.simulate(scene, sp.XPBD(), dt=1 / 60, steps=12))
    other = list(sp.simulate(scene, sp.XPBD(), dt=1 / 60, steps=6, start=one[5]))
    np.testing.assert_array_equal(other[-1].positions["cloth"], one[-1].positions["cloth"])


def dropped(seed):
    """Sheets, a balloon, a soft and a rigid body with random materials and rotations, one above the other."""
    rng = np.random.default_rng(seed)
    box = sp.shapes.box(size=(0.08, 0.06, 0.05), divisions=(2, 2, 2))
    ball = sp.shapes.sphere(radius=0.05, edge_length=0.03).surface.compact()
    bodies = []
    for k, kind in enumerate(["sheet", *rng.permutation(["sheet", "balloon", "soft", "rigid"])]):
        thickness = 10.0 ** rng.uniform(-3.3, -2.3)
        material = sp.ShellMaterial(youngs=10.0 ** rng.uniform(4, 7), poisson=0.3, thickness=thickness, density=400.0)
        place = {
            "position": (*rng.uniform(-0.05, 0.05, 1), 0.2 + 0.25 * k, 0.0),
            "rotation": tuple(rng.uniform(-3, 3, 3)),
        }
        place["velocity"] = (*rng.uniform(-1.0, 1.0, 1), -3.0, 0.0)
        if kind == "soft":
            soft = sp.StableNeoHookean(youngs=10.0 ** rng.uniform(4, 6), poisson=0.4)
            bodies.append(sp.Body(f"{k}", box, soft, **place))
        elif kind == "rigid":
            bodies.append(sp.RigidBody(f"{k}", box.surface, density=800.0, **place))
        else:
            n = int(rng.integers(3, 8))
            flat = sheet((n, n), (0.2, 0.2), "random", seed).transformed(translation=(-0.1, 0.0, -0.1))
            bodies.append(sp.Shell(f"{k}", ball if kind == "balloon" else flat, material, **place))
    return sp.Scene(bodies, obstacles=[sp.HalfSpace(friction=0.4)])


@pytest.mark.parametrize("seed", range(3))
def test_nothing_crosses_in_random_drops_with_the_defaults(seed):
    scene = dropped(seed)
    table = np.ones((len(scene.bodies), len(scene.bodies)), dtype=np.bool_)
    for frame in sp.simulate(scene, sp.XPBD(), dt=1 / 60, steps=36):
        points, triangles, owner = [], [], []
        for k, body in enumerate(scene.bodies):
            triangles.append(body.triangles + sum(map(len, points)))
            points.append(frame.positions[body.name])
            owner.append(np.full(len(body.triangles), k))
        surfaces = np.concatenate(triangles).astype(np.int32), np.concatenate(owner).astype(np.int32)
        assert len(crossing_triangles(np.concatenate(points), *surfaces, table, 1)[0]) == 0
        assert min(x[:, 1].min() for x in points) > -1e-3
