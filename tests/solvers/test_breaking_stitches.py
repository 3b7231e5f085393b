"""Stitches that carry more than their strength break, and nothing else does; in both solvers."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import supple as sp

SOLVERS = {"xpbd": sp.XPBD(), "implicit": sp.Implicit()}
HARD = sp.StableNeoHookean(youngs=5e5, poisson=0.3, density=200.0, damping=2e-3)
SOFT = sp.StableNeoHookean(youngs=5e4, poisson=0.3, density=500.0, damping=5e-3)
CUBE = sp.shapes.box((0.05, 0.05, 0.05), (1, 1, 1))
DT = 1 / 60
# By kind, the stitches of four pairs 1 cm apart with a stiffness of about 500 N/m each.
KINDS = {
    "vertex_vertex": (sp.VertexVertexStitch, {"stiffness": 500.0}),
    "vertex_edge": (sp.VertexEdgeStitch, {"stiffness": 500.0}),
    "soft_vertex_triangle": (sp.SoftVertexTriangleStitch, {"youngs": 1e4, "poisson": 0.2}),
}
HELD = ("stone", "plate", "cube")  # what else the cube hangs on, by kind
parametrized = pytest.mark.parametrize("solver", SOLVERS.values(), ids=SOLVERS)


def hanging(kind, strength, load, held="cube", **more):
    """A cube below another one that is held, or below a plate, pulled down by `load` newtons a second."""
    made, law = KINDS[kind]
    low = sp.Body("low", CUBE, HARD, position=(0, -0.06, 0))
    seam = made("low", held, max_distance=0.0101, damping=5e-3, strength=strength, name="seam", **(law | more))
    pull = sp.Force("low", sp.InBox((-1, -1, -1), (1, -0.08, 1)), lambda t: (0.0, -load * t, 0.0))
    others, plate = {"bodies": [low]}, sp.shapes.box_surface((0.05, 0.05, 0.05), (1, 1, 1))
    if held == "cube":
        others["bodies"] += [sp.Body("cube", CUBE, HARD)]
        others["pins"] = [sp.Pin("cube", sp.InBox((-1, 0.02, -1), (1, 1, 1)))]
    elif held == "stone":
        others["bodies"] += [sp.RigidBody("stone", plate, mass=1.0)]
        others["pins"] = [sp.Pin("stone")]
    else:
        others["obstacles"] = [sp.obstacles.TriangleObstacle(name="plate", surface=plate)]
    return sp.Scene(gravity=(0, 0, 0), stitches=[seam], forces=[pull], **others)


def broken(frames):
    """By frame, the rows of pairs that broke."""
    return {f.index: f.report.broken_stitches for f in frames if f.report.broken_stitches}


@parametrized
@pytest.mark.parametrize(("kind", "held"), list(zip(KINDS, HELD, strict=True)))
def test_those_break_whose_force_exceeds_their_strength(tmp_path, solver, kind, held):
    """Four pairs share the load. One of 1 N breaks at 4 N. Then its neighbours carry 2 N each, and hold to 6 N."""
    pairs = hanging(kind, None, 8.0, held).stitching.names.pairs
    weak = np.arange(4) == 1
    path = tmp_path / "r.vtkhdf"
    scene = hanging(kind, np.where(weak, 1.0, 3.0), 8.0, held)
    *frames, last = sp.simulate(scene, solver, DT, 39, sinks=[sp.Recorder(path)])  # to 5.2 N
    (index,) = broken(frames)
    assert index * DT == pytest.approx(0.5, abs=0.05)
    assert np.array_equal(broken(frames)[index]["seam"], pairs[weak])
    assert last.state.broken_stitches.tolist() == np.flatnonzero(weak).tolist()
    assert len(last.system.stitching) == 3
    assert last.report.work["breaking"] == 0.0
    breaking = frames[index - 1].report
    assert breaking.work["breaking"] == pytest.approx(-breaking_energy(frames[index - 2])[weak].sum(), rel=0.2)
    assert breaking.energy - frames[index - 2].report.energy == pytest.approx(
        sum(breaking.work.values()) + breaking.energy_residual, rel=1e-9
    )
    with sp.read_recording(path) as recording:
        report = recording.check()
        assert report.ok, str(report)
        assert np.array_equal(recording[index].report.broken_stitches["seam"], pairs[weak])
        assert not recording[index - 1].report.broken_stitches
        assert not recording[-1].report.broken_stitches
        assert np.array_equal(recording[-1].state.broken_stitches, last.state.broken_stitches)


def breaking_energy(frame):
    from supple.scene.stitches.measures import stitch_energies

    stitching = frame.system.stitching
    return stitch_energies(stitching, stitching.points(frame.state.positions, frame.time))


def strips(strength):
    """A strip on one that is held, and whose left end is lifted."""
    mesh = sp.shapes.box((0.32, 0.02, 0.04), (8, 1, 1))
    low, high = sp.Body("low", mesh, SOFT), sp.Body("high", mesh, SOFT, position=(0, 0.022, 0))
    seam = sp.VertexVertexStitch("high", "low", max_distance=0.0025, stiffness=200.0, damping=5e-3, strength=strength)
    lift = sp.Keyframes([0.0, 1.0], displacements=[(0, 0, 0), (0, 0.15, 0)])
    pins = [
        sp.Pin("low", sp.InBox((-1, -1, -1), (1, -0.009, 1))),
        sp.Pin("high", sp.InBox((-1, 0.0319, -1), (-0.159, 1, 1)), lift),
    ]
    return sp.Scene([low, high], pins=pins, stitches=[seam], gravity=(0, 0, 0))


@parametrized
def test_a_zip_opens_one_after_another(tmp_path, solver):
    path = tmp_path / "r.vtkhdf"
    frames = list(sp.simulate(strips(0.15), solver, DT, 15, sinks=[sp.Recorder(path)]))
    x = {k: frames[0].system.scene.bodies[1].mesh.vertices[k, 0] for k in range(36)}
    places = [[x[int(pair[0])] for pair in pairs] for item in broken(frames).values() for pairs in item.values()]
    assert len(places) >= 3  # frames in which one or more break
    assert all(max(before) <= min(after) + 1e-9 for before, after in pairwise(places))
    assert 4 <= len(frames[7].state.broken_stitches) <= 10  # of 18
    assert 12 <= sum(map(len, places)) == len(frames[-1].state.broken_stitches)
    with sp.read_recording(path) as recording:
        report = recording.check()
        assert report.ok, str(report)


@parametrized
def test_a_strength_that_is_never_reached_changes_no_bit(solver):
    free, strong = (list(sp.simulate(strips(strength), solver, DT, 8)) for strength in (None, 1e9))
    for one, other in zip(free, strong, strict=True):
        assert one.state.positions.tobytes() == other.state.positions.tobytes()
        assert one.state.velocities.tobytes() == other.state.velocities.tobytes()
        assert one.report.energy == other.report.energy
    assert "breaking" in other.report.work
    assert "breaking" not in one.report.work


@parametrized
def test_pieces_that_are_not_joined_any_more_keep_their_own_momenta(solver):
    """Two cubes part; the stitch between them breaks, and then nothing acts on either."""
    a, b = sp.Body("a", CUBE, SOFT, velocity=(-1, 0, 0)), sp.Body("b", CUBE, SOFT, position=(0.06, 0, 0))
    seam = sp.VertexVertexStitch("b", "a", max_distance=0.0101, stiffness=20.0, strength=0.2)
    frames = list(sp.simulate(sp.Scene([a, b], stitches=[seam], gravity=(0, 0, 0)), solver, DT, 12))
    (end,) = broken(frames)
    momenta = [frame.system.masses[:8] @ frame.state.velocities[:8] for frame in frames]
    assert np.abs(np.diff(momenta[end - 1 :], axis=0)).max() < 1e-9 * abs(momenta[0]).max()
    assert frames[-1].report.stitch_energy == 0.0
    assert frames[-1].report.largest_stitch_stretch is None


@parametrized
def test_a_run_goes_on_across_a_break_with_the_same_bits(tmp_path, solver):
    scene = strips(0.15)
    whole = list(sp.simulate(scene, solver, DT, 12))
    first = next(iter(broken(whole)))
    assert first < 10
    for begun in (whole[first - 1], whole[first]):
        rest = list(sp.simulate(scene, solver, DT, 12 - begun.index, start=begun))
        assert all(map(same_bits, whole[begun.index :], rest))
    frames = sp.simulate(
        strips(0.15), solver, DT, 12, sinks=[sp.RunFolder(tmp_path / "out", solver, checkpoint_every=1)]
    )
    for frame in frames:
        if frame.index == first + 1:
            break
    frames.close()
    assert all(map(same_bits, whole[first + 1 :], sp.resume(tmp_path / "out", strips(0.15), solver)))
    with sp.read_recording(tmp_path / "out" / "recording.vtkhdf") as recording:
        assert len(recording) == 13
        assert all(map(same_bits, whole, list(recording)[1:]))
        assert list(broken(recording)) == list(broken(whole))
        again = next(sp.simulate(scene, solver, DT, 1, start=recording[first].state))
        assert np.isin(whole[first - 1].state.broken_stitches, again.state.broken_stitches).all()
        assert len(again.system.stitching) == 18 - len(again.state.broken_stitches)


def same_bits(one, other):
    return (
        one.state.positions.tobytes() == other.state.positions.tobytes()
        and one.state.velocities.tobytes() == other.state.velocities.tobytes()
        and one.state.broken_stitches.tolist() == other.state.broken_stitches.tolist()
        and one.state.separated_stitches.tolist() == other.state.separated_stitches.tolist()
    )


@parametrized
@pytest.mark.parametrize("below", ["cube", "plate"])
def test_what_was_torn_off_falls_back_onto_what_it_was_stitched_to(tmp_path, solver, below):
    """In both, from the same place onto the same triangles, which stitches had excluded from contact."""
    mesh, plate = sp.shapes.box((0.05, 0.05, 0.05), (2, 1, 2)), sp.shapes.box_surface((0.2, 0.05, 0.2), (2, 1, 2))
    top = sp.Body("top", mesh, SOFT, position=(0, 0.051, 0), velocity=(0, 0.8, 0), friction=0.2)
    seam = sp.VertexVertexStitch("top", below, max_distance=0.03, stiffness=20.0, strength=0.05)
    parts = {"stitches": [seam], "gravity": (0, -9.81, 0)}
    if below == "cube":
        base = sp.Body("cube", sp.shapes.box((0.2, 0.05, 0.2), (4, 1, 4)), SOFT)
        scene = sp.Scene([base, top], pins=[sp.Pin("cube", sp.InBox((-1, -1, -1), (1, -0.0249, 1)))], **parts)
    else:
        scene = sp.Scene([top], [sp.obstacles.TriangleObstacle(name="plate", surface=plate)], **parts)
    path = tmp_path / "r.vtkhdf"
    frames = list(sp.simulate(scene, solver, DT, 17, sinks=[sp.Recorder(path)]))
    assert len(broken(frames)) >= 1
    assert len(frames[-1].state.separated_stitches) == len(scene.stitching) >= 5
    heights = [frame.positions["top"][:, 1].min() for frame in frames]
    assert max(heights) > 0.03
    assert min(heights) > 0.0245
    assert heights[-1] < 0.026
    assert {str(frame.report.status) for frame in frames} == {"converged"}
    begun = next(frame for frame in frames if len(frame.state.separated_stitches))
    rest = sp.simulate(scene, solver, DT, 17 - begun.index, start=begun)
    assert all(map(same_bits, frames[begun.index :], rest))
    with sp.read_recording(path) as recording:
        report = recording.check()
        assert report.ok, str(report)
        for one, other in zip(frames, recording[1:], strict=True):
            assert one.state.separated_stitches.tolist() == other.state.separated_stitches.tolist()


def test_sides_that_touch_collide_only_when_they_are_apart():
    """A cube on another one is torn off sideways, while they touch."""
    base = sp.Body("cube", sp.shapes.box((0.2, 0.05, 0.2), (4, 1, 4)), SOFT)
    mesh = sp.shapes.box((0.05, 0.05, 0.05), (2, 1, 2))
    top = sp.Body("top", mesh, SOFT, position=(0, 0.05, 0), velocity=(1.0, 0, 0), friction=0.2)
    seam = sp.SoftVertexTriangleStitch("top", "cube", max_distance=1e-6, youngs=1e4, poisson=0.3, strength=0.05)
    held = sp.Pin("cube", sp.InBox((-1, -1, -1), (1, -0.0249, 1)))
    frames = list(sp.simulate(sp.Scene([base, top], pins=[held], stitches=[seam]), sp.Implicit(), DT, 20))
    counts = [(len(frame.state.broken_stitches), len(frame.state.separated_stitches)) for frame in frames]
    assert counts[-1] == (9, 9)
    assert all(separated <= of for of, separated in counts)
    assert counts == sorted(counts)
    assert {str(frame.report.status) for frame in frames} == {"converged"}
    assert min(frame.positions["top"][:, 1].min() for frame in frames[5:]) > 0.0245


def test_an_equilibrium_that_lost_what_held_it_ends_the_run():
    scene = hanging("vertex_vertex", 1.0, 4.0)
    with pytest.warns(sp.SuppleWarning, match="nothing holds it"):
        frames = list(sp.simulate(scene, sp.Implicit(integrator="static"), 0.5, 5))
    assert frames[-1].report.status == "line_search_failed"
    assert len(frames) < 5
    assert len(frames[-1].state.broken_stitches) == 4


def test_a_start_of_another_scene_is_an_error():
    scene = hanging("vertex_vertex", 1.0, 4.0)
    state = replace(scene_start(scene), broken_stitches=np.array([7]))
    with pytest.raises(sp.SceneError, match="broken stitches that the scene does not have"):
        sp.simulate(scene, sp.XPBD(), DT, 1, start=state)


def scene_start(scene):
    from supple.model.system import initial_state

    return initial_state(scene)
