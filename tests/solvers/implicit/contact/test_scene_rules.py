"""What may touch, contact's settings, scales, bits, hand-over, and the list of contacts."""

import numpy as np
import pytest
from tests.scenes import converged

import supple as sp
from supple.runtime.threads import numba_threads

WEIGHT = 0.2**3 * 1000.0 * 9.81


def cube(name="cube", size=0.2, divisions=1, youngs=2e4, **body):
    material = sp.StableNeoHookean(youngs=youngs, poisson=0.3, density=1000.0)
    return sp.Body(name, sp.shapes.box((size,) * 3, (divisions,) * 3), material, **body)


def run(scene, dt, steps, solver=None, **start):
    return converged(sp.simulate(scene, solver or sp.Implicit(), dt, steps, **start))


@pytest.mark.parametrize(
    ("given", "complaint"),
    [
        ({"dhat": 0.0}, "dhat is 0; it must be above zero"),
        ({"dhat": "1"}, "dhat is '1'"),
        ({"dhat": float("nan")}, "dhat is nan"),
        ({"stiffness": -1.0}, "stiffness is -1; it must be above zero, or .adaptive."),
        ({"stiffness": "stiff"}, "stiffness is 'stiff'"),
        ({"friction_velocity": float("inf")}, "friction_velocity is inf"),
        ({"friction_velocity": True}, "friction_velocity is True"),
        ({"friction_iterations": 0}, "friction_iterations is 0"),
        ({"friction_iterations": 1.5}, "friction_iterations is 1.5"),
        ({"friction_iterations": True}, "friction_iterations is True"),
    ],
)
def test_settings_out_of_range_are_errors(given, complaint):
    with pytest.raises(sp.SolverError, match=rf"IPCContact: {complaint}"):
        sp.IPCContact(**given)


def test_obstacles_without_contact_are_an_error():
    scene = sp.Scene([cube()], obstacles=[sp.HalfSpace(name="floor")])
    with pytest.raises(sp.SolverError, match=r"obstacle 'floor': with contact=None obstacles have no effect"):
        sp.simulate(scene, sp.Implicit(contact=None), dt=1 / 60, steps=1)


def test_pairs_that_do_not_collide_fall_through():
    floor = sp.HalfSpace(name="floor")
    ghost = sp.ContactPair("ghost", "floor", collide=False)
    bodies = [cube("solid", position=(0, 0.11, 0)), cube("ghost", position=(1, 0.11, 0))]
    last = run(sp.Scene(bodies, obstacles=[floor], contact_pairs=[ghost]), 0.05, 8)[-1]
    assert last.positions["solid"][:, 1].min() > 0.0
    assert last.positions["ghost"][:, 1].max() < -0.2
    assert np.abs(last.report.details.contact_forces["ghost"]).max() == 0.0


def test_bodies_that_do_not_collide_pass_through_each_other():
    apart = sp.ContactPair("one", "two", collide=False)
    bodies = [cube("one", velocity=(1, 0, 0)), cube("two", position=(0.21, 0.01, 0.02), velocity=(-1, 0, 0))]
    last = run(sp.Scene(bodies, contact_pairs=[apart], gravity=(0, 0, 0)), 0.05, 6)[-1]
    assert last.positions["one"][:, 0].mean() == pytest.approx(0.3, abs=1e-9)
    assert last.positions["two"][:, 0].mean() == pytest.approx(-0.09, abs=1e-9)


def test_the_friction_of_a_pair_holds():
    """Two cubes on one smooth floor, of which one pair is rough: it stops, the other goes on."""
    rough = sp.ContactPair("rough", "floor", friction=0.5)
    bodies = [
        cube(name, youngs=1e6, position=(0, 0.1002, z), velocity=(1, 0, 0)) for name, z in (("rough", 0), ("smooth", 1))
    ]
    scene = sp.Scene(bodies, obstacles=[sp.HalfSpace(name="floor")], contact_pairs=[rough])
    last = run(scene, 0.01, 30)[-1]
    assert abs(last.velocities["rough"][:, 0].mean()) < 0.05
    assert last.velocities["smooth"][:, 0].mean() == pytest.approx(1.0, abs=1e-6)


def test_contacts_lie_between_the_surfaces_and_sum_to_the_reported_forces():
    bodies = [
        cube("lower", youngs=1e5, friction=0.6, position=(0, 0.1002, 0)),
        cube("upper", youngs=1e5, friction=0.6, position=(0.04, 0.3005, 0.03)),
    ]
    table = sp.obstacles.Box(center=(0, -0.5, 0), size=(2, 1, 2), friction=0.6, name="table")
    wall = sp.HalfSpace(point=(-5, 0, 0), normal=(1, 0, 0), name="wall")
    last = run(sp.Scene(bodies, obstacles=[table, wall]), 0.05, 30)[-1]
    found, details = last.contacts, last.report.details
    assert found is not None
    assert found.names == ("lower", "upper", "table", "wall")
    assert len(found) == details.contacts > 4
    assert np.allclose(np.linalg.norm(found.normals, axis=1), 1.0)
    assert (found.distances > 0.0).all()
    assert (found.distances < details.dhat).all()
    assert found.distances.min() == pytest.approx(last.report.min_distance)
    # Forces push the first thing away from the second; smoothed nearly parallel edges may pull, by next to nothing.
    assert (np.einsum("ij,ij->i", found.forces, found.normals) >= -1e-3 * WEIGHT).all()
    for name in ("lower", "upper", "table"):
        total = sum(found.force_between(name, other) for other in found.names if other != name)
        reported = details.contact_forces[name] + details.friction_forces[name]
        assert np.abs(total - reported).max() < 1e-6 * WEIGHT
    assert np.array_equal(found.force_between("lower", "upper"), -found.force_between("upper", "lower"))
    assert found.force_between("upper", "lower")[1] == pytest.approx(WEIGHT, rel=2e-2)
    assert found.force_between("lower", "table")[1] == pytest.approx(2 * WEIGHT, rel=2e-2)
    # In the middle of the gap: below one surface and above the other.
    with_table = (found.first == 2) | (found.second == 2)
    lowest = last.positions["lower"][:, 1].min()
    assert (found.points[with_table][:, 1] > 0.0).all()
    assert (found.points[with_table][:, 1] < lowest + details.dhat).all()


def scaled(size):
    """A tilted cube falls on a rough table, and another one on it; lengths times `size`, times and densities kept."""
    material = sp.StableNeoHookean(youngs=2e4 * size**2, poisson=0.3, density=1000.0)
    mesh = sp.shapes.box((0.2 * size,) * 3, (1, 1, 1))
    bodies = [
        sp.Body("one", mesh, material, position=(0, 0.18 * size, 0), rotation=(0.2, 0.1, 0.3), friction=0.3),
        sp.Body("two", mesh, material, position=(0.05 * size, 0.45 * size, 0.02 * size), friction=0.3),
    ]
    table = sp.obstacles.Box(center=(0, -0.5 * size, 0), size=(2 * size, size, 2 * size), friction=0.3)
    return sp.Scene(bodies, obstacles=[table], gravity=(0, -9.81 * size, 0))


def test_a_scene_in_millimetres_has_the_shapes_of_the_scene_in_metres():
    # Up to here both bodies have hit something. Each impact lets round-off grow a thousandfold or more.
    large, small = (run(scaled(size), 0.02, 12, sp.Implicit(tolerance=1e-7)) for size in (1.0, 1e-3))
    assert large[-1].report.details.contacts > 0
    for a, b in zip(large, small, strict=True):
        # Where a contact is first met, and so its weight, depends on Newton's method up to its tolerance.
        assert np.abs(1e3 * b.state.positions - a.state.positions).max() < 3e-5


def test_the_same_bits_whatever_the_number_of_threads():
    bodies = [
        cube("one", divisions=3, friction=0.3, position=(0, 0.105, 0)),
        cube("two", divisions=3, friction=0.3, position=(0.03, 0.31, 0.01), velocity=(0, -1, 0)),
    ]
    table = sp.obstacles.Box(center=(0, -0.5, 0), size=(2, 1, 2), friction=0.3)
    ends = []
    for threads in (1, None, None):
        with numba_threads(threads):
            ends.append(run(sp.Scene(bodies, obstacles=[table]), 0.02, 4)[-1])
    assert ends[0].report.details.contacts > 10
    assert len({end.state.positions.tobytes() for end in ends}) == 1


def test_a_scene_goes_from_xpbd_to_implicit_and_back():
    """A cube falls with XPBD, continues with the implicit solver, and with XPBD again."""
    scene = sp.Scene([cube(position=(0, 0.15, 0))], obstacles=[sp.HalfSpace(friction=0.3)])
    first = run(scene, 1 / 60, 6, sp.XPBD())[-1]
    assert first.positions["cube"][:, 1].min() > 0.0
    exact = run(scene, 1 / 60, 20, start=first)
    assert exact[0].index == first.index + 1
    assert exact[0].time == pytest.approx(first.time + 1 / 60)
    assert all(frame.positions["cube"][:, 1].min() > 0.0 for frame in exact)
    again = run(scene, 1 / 60, 5, sp.XPBD(), start=exact[-1])
    assert np.abs(again[-1].positions["cube"] - exact[-1].positions["cube"]).max() < 5e-3


def test_a_frame_that_intersects_is_an_error_with_a_remedy():
    one, two = cube("one"), cube("two", position=(0.15, 0.02, 0.01))
    overlap = sp.Scene([one, two], gravity=(0, 0, 0))
    frame = list(sp.simulate(overlap, sp.XPBD(contact=None), 1 / 60, 1))[-1]
    with pytest.raises(sp.SuppleError, match=r"(?s)one.*two") as caught:
        list(sp.simulate(overlap, sp.Implicit(), 1 / 60, 1, start=frame))
    assert "overlaps" in str(caught.value)


def test_a_frame_with_inverted_tets_is_an_error_where_the_material_has_no_energy():
    material = sp.NeoHookean(youngs=2e4, poisson=0.3, density=1000.0)
    mesh = sp.shapes.box((0.2, 0.2, 0.2), (1, 1, 1))
    scene = sp.Scene([sp.Body("cube", mesh, material)], gravity=(0, 0, 0))
    flipped = mesh.vertices * np.array([1, -1, 1])
    with pytest.raises(sp.SuppleError, match=r"'cube'.*inverted.*StableNeoHookean"):
        list(sp.simulate(scene, sp.Implicit(), 1 / 60, 1, initial_positions={"cube": flipped}))
