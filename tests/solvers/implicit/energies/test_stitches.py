"""Stitches in the implicit solver: beams, momentum, obstacles, and contact between what is stitched."""

import numpy as np
import pytest
from tests.derivatives import assert_derivatives
from tests.scenes import at_start

import supple as sp
from supple.model.system import build_system, initial_state
from supple.solvers.implicit.energies.stitches import StitchEnergy

SOFT = sp.StableNeoHookean(youngs=5e4, poisson=0.4, density=1000)
SHEET = sp.SurfaceMesh([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], [[0, 2, 1], [0, 3, 2]])
WALL = sp.InBox((-1e-9, -1, -1), (1e-9, 1, 1))


def box(name, y, **more):
    return sp.Body(name, sp.shapes.box((0.1, 0.1, 0.1), (2, 2, 2)), SOFT, position=(0, y, 0), **more)


def bar(halves, length=1.0, weight=0.2, **stitch):
    """A bar of one or two halves that is held at one end: the displacement of its free end in equilibrium [m].

    Parameters
    ----------
    weight : acceleration by gravity times the length [m^2/s^2]: bars of all lengths bend alike
    """
    mesh = sp.shapes.box((length / halves, 0.1 * length, 0.1 * length), (10 // halves, 3, 3))
    material = sp.StableNeoHookean(youngs=1e5, poisson=0.3, density=1000)
    places = [(length / halves * (k + 0.5), 0, 0) for k in range(halves)]
    bodies = [sp.Body(name, mesh, material, position=at) for name, at in zip("ab", places, strict=False)]
    stitches = []
    if halves == 2:
        stitches = [sp.SoftVertexTriangleStitch("a", "b", max_distance=1e-6 * length, poisson=0.3, **stitch)]
    scene = sp.Scene(bodies, pins=[sp.Pin("a", WALL)], stitches=stitches, gravity=(0, -weight / length, 0))
    *_, frame = sp.simulate(scene, sp.Implicit(integrator="static", contact=None), 1.0, 1)
    assert frame.report.status == "converged"
    start = bodies[-1].place(mesh.vertices)
    return (frame.positions[bodies[-1].name] - start)[start[:, 0] > length * (1 - 1e-9)].mean(axis=0)


def test_a_bar_of_two_halves_stays_straight_where_nothing_loads_it():
    moved = bar(2, youngs=1e6, min_separate_distance=1e-3, weight=0.0)
    assert moved[0] == pytest.approx(1e-3, rel=1e-3)  # the stitches keep the halves their distance apart
    assert np.abs(moved[1:]).max() < 1e-6


@pytest.mark.parametrize("length", [1.0, 0.03])
def test_two_half_bars_bend_like_one_and_less_the_stiffer_the_stitches(length):
    one = bar(1, length)[1]
    assert one < -0.1 * length
    sag = np.array([bar(2, length, youngs=youngs)[1] / one for youngs in (1e3, 1e4, 1e5, 1e6, 1e7)])
    assert np.all(np.diff(sag) < 0.0), sag
    assert sag == pytest.approx([1.1057, 1.0139, 1.0025, 1.0011, 1.0006], rel=1e-3)


def stitched_pair():
    stitches = [
        sp.SoftVertexTriangleStitch("a", "b", max_distance=0.051, youngs=1e5, poisson=0.3),
        sp.VertexEdgeStitch("b", "a", max_distance=0.051, stiffness=20.0, rest_length=0.03),
        sp.VertexVertexStitch("a", "b", pairs=[[0, 3]], stiffness=5.0),
    ]
    spinning = box("a", 0.2, velocity=(0.1, 0.05, 0), angular_velocity=(0, 2, 1))
    return sp.Scene([spinning, box("b", 0.05)], stitches=stitches, gravity=(0, 0, 0))


@pytest.mark.parametrize("integrator", ["backward_euler", "newmark"])
def test_a_free_stitched_pair_keeps_its_momentum(integrator):
    momentum = 1.0 * np.array([0.1, 0.05, 0])
    for frame in sp.simulate(stitched_pair(), sp.Implicit(integrator=integrator), 1 / 60, 20):
        assert frame.report.status == "converged"
        assert np.abs(frame.report.linear_momentum - momentum).max() <= 1e-9


def test_stitches_have_no_total_force_or_moment():
    system = build_system(stitched_pair())
    assert system.joined_components.max() == 0
    x = np.random.default_rng(0).normal(size=system.rest_positions.shape)
    gradient = np.zeros_like(x)
    StitchEnergy.of(system.stitching, 0.0).add_gradient(x, gradient)
    size = np.abs(gradient).sum()
    assert size > 1.0
    assert np.abs(gradient.sum(axis=0)).max() <= 1e-13 * size
    assert np.abs(np.cross(x, gradient).sum(axis=0)).max() <= 1e-13 * size


def test_the_error_of_angular_momentum_falls_with_the_step():
    """Backward Euler damps rotations in proportion to its step; stitches add nothing to that."""
    losses = []
    for steps in (10, 20, 40):
        frames = list(sp.simulate(stitched_pair(), sp.Implicit(tolerance=1e-6), 0.1 / steps, steps))
        L = [np.linalg.norm(frame.report.angular_momentum) for frame in frames]
        losses.append(1.0 - L[-1] / np.linalg.norm(at_start(stitched_pair()).angular_momentum))
    assert 0.0 < losses[2] < 0.7 * losses[1] < 0.7 * 0.7 * losses[0]


def swinging(damping):
    """A box that hangs on springs and tets, released in a stretched state, without gravity."""
    sheet = sp.obstacles.TriangleObstacle(name="sheet", surface=SHEET)
    stitches = [
        sp.SoftVertexTriangleStitch("a", "sheet", pairs=[[8, 0], [9, 1]], youngs=2e4, poisson=0.3, damping=damping),
        sp.VertexEdgeStitch("a", "sheet", pairs=[[20, 0]], stiffness=50.0, damping=damping),
        sp.VertexVertexStitch("a", "sheet", pairs=[[21, 1]], stiffness=50.0, damping=damping),
    ]
    return sp.Scene([box("a", -0.2, velocity=(0, -0.5, 0))], [sheet], stitches=stitches, gravity=(0, 0, 0))


@pytest.mark.slow
@pytest.mark.parametrize("integrator", ["bdf2", "newmark"])
def test_damped_stitches_lose_as_much_energy_as_those_of_xpbd(integrator):
    left = {}
    for name, solver in (("implicit", sp.Implicit(integrator=integrator)), ("xpbd", sp.XPBD(substeps=40))):
        for damping in (0.0, 0.05):
            *_, frame = sp.simulate(swinging(damping), solver, 1 / 240, 24)
            report = frame.report
            assert report.status == "converged", report.message
            left[name, damping] = report.kinetic_energy + report.elastic_energy + report.stitch_energy
    assert left["implicit", 0.05] < 0.9 * left["implicit", 0.0]
    assert left["implicit", 0.05] == pytest.approx(left["xpbd", 0.05], rel=0.15)


def test_damping_is_a_potential_with_slope_two_and_is_zero_for_rotations():
    from supple.solvers.implicit.energies.damping import StrainRate
    from supple.solvers.implicit.energies.potential import HessianBlocks
    from supple.solvers.implicit.energies.stitch_damping import StitchViscosity

    scene = stitched_pair()
    damped = [sp.SoftVertexTriangleStitch("a", "b", max_distance=0.051, youngs=1e5, poisson=0.3, damping=0.02)]
    damped.append(sp.VertexEdgeStitch("b", "a", max_distance=0.051, stiffness=20.0, damping=0.03))
    stitching = sp.Scene(scene.bodies, stitches=damped).stitching
    viscosity = StitchViscosity.of(stitching)
    assert viscosity is not None
    assert StitchViscosity.of(scene.stitching) is None
    rng = np.random.default_rng(4)
    x = initial_state(scene).positions
    x = x + 0.004 * rng.normal(size=x.shape)
    before = x + 0.004 * rng.normal(size=x.shape)
    potential = viscosity.damping(StrainRate(60.0, viscosity.strains(before)))
    d = 1e-3 * rng.normal(size=x.shape)

    blocks = HessianBlocks.zeros(0, len(x), len(stitching))
    potential.add_hessian(x, blocks, False)
    nodes = stitching.elements()
    longer = np.concatenate([d, np.zeros((1, 3))])
    product = np.zeros_like(longer)
    moved = np.einsum("kij,kj->ki", blocks.stitches, longer[nodes].reshape(-1, 12))
    np.add.at(product, nodes, moved.reshape(-1, 4, 3))
    assert_derivatives(potential, product[:-1], x, d, 1.0)
    # The same shape, turned: nothing to damp.
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    still = viscosity.damping(StrainRate(60.0, viscosity.strains(x)))
    assert still.value(x @ turn.T + 1.0) < 1e-15 * potential.value(x)


@pytest.mark.parametrize("moving", [False, True])
def test_a_body_hangs_on_an_obstacle(moving):
    motion = sp.Keyframes([0.0, 1.0], [[0, 0, 0], [0, 0.3, 0]]) if moving else None
    sheet = sp.obstacles.TriangleObstacle(name="sheet", surface=SHEET, motion=motion)
    floor = sp.HalfSpace(name="floor", point=(0, -2, 0))
    stitch = sp.SoftVertexTriangleStitch("a", "sheet", max_distance=0.021, youngs=3e5, poisson=0.3)
    scene = sp.Scene([box("a", -0.07)], [floor, sheet], stitches=[stitch], gravity=(0, -1, 0))
    steps, dt = (10, 0.1) if moving else (1, 1.0)
    *_, frame = sp.simulate(scene, sp.Implicit(integrator="static"), dt, steps)
    assert frame.report.status == "converged", frame.report.message
    lifted = 0.3 if moving else 0.0
    x = frame.positions["a"]
    assert x[:, 1].max() == pytest.approx(lifted - 0.02, abs=2e-3)
    assert np.abs(x[:, [0, 2]].mean(axis=0)).max() < 1e-3


def corner_in_a_face():
    """A box on its corner, which sticks 1 mm into the middle of a triangle of the box below."""
    turn = np.array([1.0, 0.0, -1.0]) / np.sqrt(2.0) * np.arccos(1.0 / np.sqrt(3.0))
    above = sp.Body("a", sp.shapes.box((0.1, 0.1, 0.1), (2, 2, 2)), SOFT, rotation=turn)
    x = above.place(above.mesh.vertices)
    below = sp.Body("b", sp.shapes.box((0.3, 0.1, 0.3), (1, 1, 1)), SOFT, position=(0, -0.05, 0))
    tip = int(np.argmin(x[:, 1]))
    shift = np.array([0.05, 0.0, -0.02]) - x[tip] - [0, 1e-3, 0]
    above = sp.Body("a", above.mesh, SOFT, position=shift, rotation=turn)
    top = [k for k, t in enumerate(below.mesh.surface.triangles) if np.all(below.mesh.vertices[t, 1] > 0)]
    return tip, above, below, top


def runs(scene):
    """Whether three steps of the scene can be computed."""
    try:
        *_, frame = sp.simulate(scene, sp.Implicit(), 1 / 60, 3)
    except sp.SuppleError:
        return False
    return frame.index == 3 and frame.report.status == "converged"


def test_surfaces_may_touch_where_they_are_stitched_and_nowhere_else():
    tip, above, below, top = corner_in_a_face()
    corners = {t: below.place(below.mesh.vertices[below.mesh.surface.triangles[t]]) for t in top}
    place = above.place(above.mesh.vertices)[tip]
    (under,) = [t for t in top if inside(place[[0, 2]], corners[t][:, [0, 2]])]
    (beside,) = set(top) - {under}
    pin = sp.Pin("b", sp.InBox((-1, -0.11, -1), (1, -0.09, 1)))

    def scene(*triangles):
        stitches = [
            sp.SoftVertexTriangleStitch("a", "b", pairs=[[tip, triangle]], youngs=1e5, poisson=0.3)
            for triangle in triangles
        ]
        return sp.Scene([above, below], pins=[pin], stitches=stitches, gravity=(0, 0, 0))

    assert not runs(scene())
    assert not runs(scene(beside))
    assert runs(scene(under))


def test_the_error_names_the_touching_floor_and_not_the_seam():
    """Halves that are stitched face to face may touch. The error is the floor that one of them touches."""
    seam = sp.SoftVertexTriangleStitch("a", "b", max_distance=1e-6, youngs=1e5, poisson=0.3)
    scene = sp.Scene([box("a", 0.15), box("b", 0.05)], [sp.HalfSpace(name="floor")], stitches=[seam])
    with pytest.raises(sp.SceneError, match="body 'b' touches obstacle 'floor'"):
        list(sp.simulate(scene, sp.Implicit(), 1 / 60, 1))
    higher = sp.Scene([box("a", 0.151), box("b", 0.051)], scene.obstacles, stitches=[seam])
    assert [frame.report.status for frame in sp.simulate(higher, sp.Implicit(), 1 / 60, 2)] == ["converged"] * 2


def inside(p, corners):
    a, b, c = corners
    signs = [(v - u)[0] * (p - u)[1] - (v - u)[1] * (p - u)[0] for u, v in ((a, b), (b, c), (c, a))]
    return min(signs) > 0 or max(signs) < 0
