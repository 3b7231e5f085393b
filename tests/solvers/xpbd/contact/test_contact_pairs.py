"""Contact pairs of a scene in XPBD: excluded pairs penetrate, and a pair's own friction is used."""

import numpy as np
import pytest

import supple as sp
from supple.model.system import build_system
from supple.scene.rotation import rotation_matrix
from supple.solvers.xpbd.contact.settings import colliding_pairs

SLOPE = np.arctan(0.5)  # 26.565 degrees: a block sticks above mu = 0.5
NORMAL = np.array([np.sin(SLOPE), np.cos(SLOPE), 0.0])
DOWN = np.array([np.cos(SLOPE), -np.sin(SLOPE), 0.0])
STIFF = sp.StableNeoHookean(youngs=1e6, poisson=0.3, density=1000)
PLATE = sp.shapes.box_surface((2.0, 0.2, 2.0), (4, 1, 4))

FLOORS = {
    "plane": lambda **options: sp.HalfSpace(name="floor", **options),
    "block": lambda **options: sp.obstacles.Box(center=(0, -0.1, 0), size=(2, 0.2, 2), name="floor", **options),
    "ball": lambda **options: sp.obstacles.Sphere(center=(0, -3, 0), radius=3, name="floor", **options),
    "room": lambda **options: sp.obstacles.Box(center=(0, 1, 0), size=(2, 2, 2), inside=True, name="floor", **options),
    "bowl": lambda **options: sp.obstacles.Sphere(center=(0, 3, 0), radius=3, inside=True, name="floor", **options),
    "triangles": lambda **options: sp.obstacles.TriangleObstacle(
        surface=PLATE.transformed(translation=(0, -0.1, 0)), name="floor", **options
    ),
    "small ball": lambda **options: sp.obstacles.Sphere(center=(0, -0.01, 0), radius=0.01, name="floor", **options),
}


def block(name, position, tilted=False, friction=0.0):
    turn = (0, 0, -SLOPE if tilted else 0)
    shape = sp.shapes.box((0.2, 0.1, 0.2), (2, 1, 2))
    return sp.Body(name, shape, STIFF, position=position, rotation=turn, friction=friction)


def last_of(scene, steps, solver=None):
    *_, frame = sp.simulate(scene, solver or sp.XPBD(substeps=10, accuracy=0.9), 1 / 60, steps)
    assert frame.report.status == "converged"
    return frame


@pytest.mark.parametrize("kind", FLOORS)
def test_an_excluded_body_falls_through_an_obstacle_that_holds_the_other(kind):
    offset = 0.0 if kind == "small ball" else 0.3
    bodies = [block("falls", (-offset, 0.1, 0)), block("rests", (offset, 0.1, 0))]
    pairs = [sp.ContactPair("falls", "floor", collide=False), sp.ContactPair("falls", "rests", collide=False)]
    frame = last_of(sp.Scene(bodies, [FLOORS[kind]()], contact_pairs=pairs), 24)
    fallen = 0.5 * 9.81 * 0.4**2
    assert frame.positions["falls"][:, 1].mean() == pytest.approx(0.1 - fallen, abs=0.05)
    assert frame.positions["rests"][:, 1].mean() > 0.0


def test_excluded_bodies_pass_through_each_other_and_others_do_not():
    bodies = [block("low", (0, 0.05, 0)), block("excluded", (0, 0.4, 0)), block("high", (0, 0.2, 0))]
    pairs = [sp.ContactPair("excluded", ["low", "high"], collide=False)]
    y = last_of(sp.Scene(bodies, [sp.HalfSpace()], contact_pairs=pairs), 40).positions
    assert y["excluded"][:, 1].min() == pytest.approx(0.0, abs=5e-3)
    assert y["high"][:, 1].min() > 0.09


@pytest.mark.parametrize(("options", "touches"), [({}, True), ({"collide": False}, False)])
def test_a_pair_of_a_body_with_itself_turns_off_self_contact(options, touches):
    pairs = [sp.ContactPair("a", "a", **options)] if options else []
    system = build_system(sp.Scene([block("a", (0, 0, 0))], contact_pairs=pairs))
    assert bool(sp.XPBD().prepare(system).contact) is touches


def test_settings_turn_off_contact_that_the_pairs_allow():
    scene = sp.Scene([block("a", (0, 0, 0)), block("b", (0, 1, 0))], contact_pairs=[sp.ContactPair("a", "b", 0.5)])
    settings = sp.XPBDContact(body_collision=False)
    assert np.array_equal(colliding_pairs(build_system(scene), settings), np.eye(2, dtype=bool))


@pytest.mark.parametrize("flat", [True, False], ids=["plane", "triangles"])
def test_friction_of_a_pair_acts_on_a_slope_beside_a_body_without_a_pair(flat):
    if flat:
        floor = sp.HalfSpace(normal=NORMAL, friction=0.2, name="slope")
    else:
        plate = PLATE.transformed(rotation=rotation_matrix((0, 0, -SLOPE))).transformed(translation=-0.1 * NORMAL)
        floor = sp.obstacles.TriangleObstacle(surface=plate, friction=0.2, name="slope")
    lifted = (0.05 if flat else 0.0506) * NORMAL
    bodies = [block(n, lifted + np.array([0, 0, z]), tilted=True) for n, z in (("own", -0.3), ("pair", 0.3))]
    scene = sp.Scene(bodies, [floor], contact_pairs=[sp.ContactPair("pair", "slope", friction=0.7)])
    x = last_of(scene, 24, sp.XPBD(substeps=20, accuracy=0.9)).positions
    travel = {body.name: (x[body.name].mean(axis=0) - np.asarray(body.position)) @ DOWN for body in bodies}
    assert abs(travel["pair"]) < 3e-3
    assert travel["own"] == pytest.approx(0.5 * 9.81 * (np.sin(SLOPE) - 0.2 * np.cos(SLOPE)) * 0.4**2, rel=0.07)


def test_friction_between_bodies_is_that_of_their_pair():
    plank = sp.Body("plank", sp.shapes.box((0.8, 0.1, 0.6), (6, 1, 6)), STIFF, position=0.05 * NORMAL,
                    rotation=(0, 0, -SLOPE), friction=0.04)  # fmt: skip
    riders = [block(n, 0.1565 * NORMAL + (0, 0, z), True, friction=1.0) for n, z in (("own", -0.16), ("pair", 0.16))]
    floor = sp.HalfSpace(normal=NORMAL, friction=5.0, name="slope")
    scene = sp.Scene([plank, *riders], [floor], contact_pairs=[sp.ContactPair("plank", "pair", friction=0.8)])
    x = last_of(scene, 18, sp.XPBD(substeps=20, accuracy=0.9)).positions
    slipped = {b.name: (x[b.name].mean(axis=0) - np.asarray(b.position)) @ DOWN for b in riders}
    assert abs(slipped["pair"]) < 0.01
    assert slipped["own"] > 0.07
