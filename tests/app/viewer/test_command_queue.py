"""The command queue: bounded, in order, with only the newest move of a grab."""

import threading
import time

from supple.app.viewer.protocol.command_queue import CommandQueue
from supple.app.viewer.protocol.commands import Grab, MoveGrab, Pause, Play, ReleaseGrab, SetParameter, SetSpeed, Step


def drained(*commands, capacity=100):
    queue = CommandQueue(capacity)
    for number, command in enumerate(commands, 1):
        queue.put(number, command)
    return queue.take(0.0)


def test_only_the_newest_move_of_each_grab_is_kept():
    first, second = [MoveGrab(1, (x, 0, 0)) for x in range(50)], [MoveGrab(2, (0, x, 0)) for x in range(50)]
    mixed = [command for pair in zip(first, second, strict=True) for command in pair]
    assert drained(*mixed) == [(99, first[-1]), (100, second[-1])]


def test_moves_keep_their_order_with_release_and_grab():
    commands = [MoveGrab(1, (1, 0, 0)), ReleaseGrab(1), Grab(1, "cube", (0,), (1,), (0, 0, 0)), MoveGrab(1, (2, 0, 0))]
    assert [command for _, command in drained(*commands)] == commands


def test_parameters_of_one_body_and_of_all_bodies_keep_their_order():
    commands = [
        SetParameter("youngs", 1e4),
        SetParameter("youngs", 2e4, "cube"),
        SetParameter("youngs", 3e4),
        SetParameter("friction", 0.5),
    ]
    assert [command for _, command in drained(*commands)] == commands
    again = [SetParameter("youngs", 1e4 + k, "cube") for k in range(10)]
    assert [command for _, command in drained(*again)] == again[-1:]


def test_the_oldest_commands_of_a_kind_can_be_taken_alone():
    queue = CommandQueue()
    first, second, release = MoveGrab(1, (1, 0, 0)), MoveGrab(2, (1, 0, 0)), ReleaseGrab(1)
    queue.put_all([(1, first), (2, second), (3, release), (4, second)])
    assert queue.take_leading(MoveGrab) == [(1, first), (2, second)]
    assert queue.take_leading(MoveGrab) == []
    queue.put(5, first)
    queue.put(6, first)
    assert queue.take(0.0) == [(3, release), (4, second), (6, first)]
    assert queue.take_leading(MoveGrab) == []


def test_no_play_pause_or_step_is_merged():
    commands = [Play(), Pause(), Play(), Step(2), Step(2)]
    assert [command for _, command in drained(*commands)] == commands


def test_commands_beyond_the_capacity_are_dropped_and_moves_are_merged():
    queue = CommandQueue(capacity=5)
    assert all(queue.put(k, Step()) for k in range(4))
    assert queue.put(4, SetSpeed(0.5))
    assert not queue.put(5, Play())
    assert queue.put(6, SetSpeed(0.25))
    assert queue.dropped == 1
    taken = queue.take(0.0)
    assert len(taken) == 5
    assert taken[-1] == (6, SetSpeed(0.25))


def test_the_release_of_a_grab_is_never_dropped():
    queue = CommandQueue(capacity=3)
    assert queue.put(1, Grab(7, "cube", (0,), (1.0,), (0, 0, 0)))
    assert queue.put(2, Play())
    assert queue.put(3, Play())
    assert not queue.put(4, Grab(8, "cube", (0,), (1.0,), (0, 0, 0)))
    # A dropped grab has no spring, so that its release may be dropped as well: the queue stays bounded.
    assert not queue.put(5, ReleaseGrab(8))
    assert queue.put(6, ReleaseGrab(7))
    assert not queue.put(7, ReleaseGrab(7))
    assert [number for number, _ in queue.take(0.0)] == [1, 2, 3, 6]


def test_a_full_queue_accepts_the_release_of_an_earlier_grab():
    queue = CommandQueue(capacity=1)
    queue.put(1, Grab(7, "cube", (0,), (1.0,), (0, 0, 0)))
    queue.take(0.0)
    queue.put(2, Play())
    assert queue.put(3, ReleaseGrab(7))
    assert queue.take(0.0) == [(2, Play()), (3, ReleaseGrab(7))]


def test_take_returns_at_a_command_and_at_close():
    queue = CommandQueue()
    threading.Timer(0.05, queue.put, (1, Play())).start()
    assert queue.take(30.0) == [(1, Play())]
    began = time.monotonic()
    threading.Timer(0.05, queue.close).start()
    assert queue.take(30.0) == []
    assert queue.closed
    assert time.monotonic() - began < 20.0
