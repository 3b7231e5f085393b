"""Interruption points: where a computation may be stopped from outside."""

import threading

import pytest

from supple.runtime.interruption import interruptible, interruption_point


def test_a_point_without_a_check_does_nothing():
    assert interruption_point() is None


def test_the_check_of_the_innermost_block_runs_at_every_point():
    reached = []
    with interruptible(lambda: reached.append("outer")):
        interruption_point()
        with interruptible(lambda: reached.append("inner")):
            interruption_point()
        interruption_point()
    interruption_point()
    assert reached == ["outer", "inner", "outer"]


def test_a_check_may_raise_and_is_gone_after_that():
    def stop():
        raise TimeoutError

    with pytest.raises(TimeoutError), interruptible(stop):
        interruption_point()
    interruption_point()


def test_other_threads_are_not_concerned():
    reached = []
    with interruptible(lambda: reached.append(1)):
        thread = threading.Thread(target=interruption_point)
        thread.start()
        thread.join()
    assert reached == []
