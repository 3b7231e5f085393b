"""Bodies that begin inside of something are named, or slowly pushed out without energy."""

import numpy as np
import pytest

import supple as sp
from supple.errors import SceneError
from supple.solvers.xpbd.solver import XPBD

DT = 1.0 / 60.0
BALL = sp.shapes.sphere(radius=0.1, edge_length=0.05)
JELLY = sp.StableNeoHookean(youngs=2e4, poisson=0.4)
FLOOR = sp.HalfSpace(name="floor", friction=0.5)


def ball(height, name="ball", x=0.0):
    return sp.Body(name, BALL, JELLY, position=(x, height, 0))


@pytest.mark.parametrize(
    ("bodies", "obstacles", "text"),
    [
        ([ball(0.05)], [FLOOR], "body 'ball' is 0.05 m deep in obstacle 'floor' at the start"),
        ([ball(-0.4)], [FLOOR], "body 'ball' is 0.5 m deep in obstacle 'floor' at the start"),
        ([ball(0.0, "a"), ball(0.0, "b", 0.13)], [], "body 'a' overlaps body 'b' at the start"),
        (
            [ball(0.0, "a"), sp.Body("b", BALL, JELLY, position=(0.01, 0, 0)), ball(1.0, "c")],
            [FLOOR],
            "is 0.1 m deep in obstacle 'floor' at the start",
        ),
    ],
    ids=["partly in the floor", "under the floor", "in another body", "both"],
)
def test_a_body_that_begins_inside_of_something_is_named_with_its_depth_and_the_remedy(bodies, obstacles, text):
    with pytest.raises(SceneError) as error:
        sp.simulate(sp.Scene(bodies, obstacles), XPBD(), DT, 1)
    assert text in str(error.value)
    assert "supple run --separate" in str(error.value)
    assert "start='push_out'" in str(error.value)


def test_a_body_inside_of_another_one_is_named():
    small = sp.Body("small", sp.shapes.sphere(radius=0.03, edge_length=0.02), JELLY)
    with pytest.raises(SceneError, match=r"body 'ball' is around body 'small'|body 'small' is inside body 'ball'"):
        sp.simulate(sp.Scene([ball(0.0), small]), XPBD(), DT, 1)


@pytest.mark.parametrize("height", [0.1, 0.0999])
def test_what_touches_or_barely_overlaps_may_start(height):
    frames = list(sp.simulate(sp.Scene([ball(height)], [FLOOR]), XPBD(), DT, 3))
    assert len(frames) == 3


def test_what_may_pass_through_may_start_inside():
    pair = sp.ContactPair("a", "b", collide=False)
    scene = sp.Scene([ball(0.0, "a"), ball(0.0, "b", 0.13)], contact_pairs=[pair], gravity=(0, 0, 0))
    assert len(list(sp.simulate(scene, XPBD(), DT, 1))) == 1
    apart = sp.Scene([ball(0.0, "a"), ball(0.0, "b", 0.13)], gravity=(0, 0, 0))
    assert len(list(sp.simulate(apart, XPBD(contact=None), DT, 1))) == 1


def test_a_state_of_the_solver_itself_is_continued_wherever_it_is():
    scene = sp.Scene([ball(0.05)], [FLOOR])
    frame = next(sp.simulate(scene, XPBD(start="push_out"), DT, 1))
    assert frame.positions["ball"][:, 1].min() < -0.02
    assert len(list(sp.simulate(scene, XPBD(), DT, 2, start=frame))) == 2


def test_a_body_that_begins_in_the_floor_is_pushed_out_gently():
    frames = list(sp.simulate(sp.Scene([ball(0.07)], [FLOOR]), XPBD(start="push_out"), DT, 90))
    last = frames[-1]
    assert min(frame.report.min_det_F for frame in frames) > 0.2
    assert max(np.abs(frame.state.velocities).max() for frame in frames) < 1.0
    assert last.positions["ball"][:, 1].min() > -0.005
    assert last.report.kinetic_energy < 0.02  # 10 cm/s, without damping
