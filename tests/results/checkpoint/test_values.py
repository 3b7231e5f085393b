"""Values as JSON and arrays: the same bits come back, and nothing else is accepted."""

import json
from dataclasses import dataclass, field

import numpy as np
import pytest

from supple.errors import OutputError
from supple.kinds.codec import decoded, described, encoded, restored


@dataclass(frozen=True)
class Inner:
    rows: np.ndarray
    label: str = "x"


@dataclass(frozen=True)
class Outer:
    inner: Inner | None
    parts: tuple
    derived: float = field(init=False, default=0.0)


CLASSES = {"Inner": Inner, "Outer": Outer}


def back(value):
    tree, arrays = encoded(value, CLASSES)
    data = b"".join(np.ascontiguousarray(array).tobytes() for array in arrays.values())
    description = json.loads(json.dumps(described(arrays)))
    return decoded(json.loads(json.dumps(tree)), restored(description, memoryview(data)), CLASSES)


def equal_bits(one, other):
    if isinstance(one, (np.ndarray, np.generic)):
        same = type(one) is type(other) and one.dtype == other.dtype and one.shape == other.shape
        return same and one.tobytes() == other.tobytes()
    if isinstance(one, (list, tuple)):
        return type(one) is type(other) and len(one) == len(other) and all(map(equal_bits, one, other))
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(equal_bits(one[key], other[key]) for key in one)
    return type(one) is type(other) and repr(one) == repr(other)


@pytest.mark.parametrize(
    "value",
    [
        None,
        True,
        -(2**80),
        0.1 + 0.2,
        5e-324,
        -0.0,
        float("inf"),
        float("nan"),
        "text ☃",
        (1, [2.0, ("a",)], {}),
        {"a": np.arange(6, dtype=np.int32).reshape(2, 3), "b": {"c": np.zeros((0, 3))}},
        np.array([np.nan, np.inf, -0.0]),
        np.array([True, False]),
        np.float32(0.1),
        np.int64(7),
        np.asfortranarray(np.arange(12.0).reshape(3, 4)),
        np.array(3.0),
    ],
    ids=repr,
)
def test_a_value_comes_back_with_the_same_bits(value):
    assert equal_bits(back(value), value)


def test_dataclasses_may_contain_each_other_and_derived_fields():
    outer = Outer(Inner(np.eye(3), "y"), (Inner(np.zeros(2)), None))
    object.__setattr__(outer, "derived", 0.25)
    again = back(outer)
    assert isinstance(again, Outer)
    assert again.derived == 0.25
    assert np.array_equal(again.inner.rows, np.eye(3))
    assert again.inner.label == "y"
    assert again.parts[1] is None
    assert np.array_equal(again.parts[0].rows, np.zeros(2))


@dataclass(frozen=True)
class Unknown:
    x: int = 0


class Inherited(Inner):
    pass


@pytest.mark.parametrize(
    "value",
    [Unknown(), Inherited(np.zeros(1)), object(), len, {1: 2}, {1, 2}, np.array(["a"]), np.array([None]), 1j],
    ids=lambda value: type(value).__name__,
)
def test_a_value_of_an_unknown_kind_is_one_line(value):
    with pytest.raises(OutputError, match="cannot be written to a file; register its class"):
        encoded((value,), CLASSES)


def nested(depth):
    tree = None
    for _ in range(depth):
        tree = {"tuple": [tree]}
    return tree


@pytest.mark.parametrize(
    "tree",
    [
        {"class": "os.system", "fields": {}},
        {"class": "Inner", "fields": {"rows": 1}},
        {"class": "Inner", "fields": {"rows": 1, "label": "x", "more": 2}},
        {"class": "Inner", "fields": [1]},
        {"array": 0},
        {"array": -1},
        {"array": True},
        {"array": "0"},
        {"tuple": 5},
        {"unknown": []},
        {"list": [], "tuple": []},
        {},
        [1, 2],
        nested(60),
    ],
    ids=str,
)
def test_other_trees_are_errors(tree):
    with pytest.raises((ValueError, TypeError, KeyError, IndexError, AttributeError)):
        decoded(tree, {}, CLASSES)


@pytest.mark.parametrize(
    ("description", "size"),
    [
        ({"a": ["<f8", [2]]}, 15),
        ({"a": ["<f8", [2]]}, 17),
        ({"a": ["|O", [1]]}, 8),
        ({"a": ["<U4", [1]]}, 16),
        ({"a": ["<M8[s]", [1]]}, 8),
        ({"a": ["<f8", [-1]]}, 8),
        ({"a": ["<f8", [1 << 39, 1 << 39]]}, 8),
        ({"a": ["<f8", [1.0]]}, 8),
        ({"a": ["<f9", [1]]}, 9),
        ({"a": ["<f8"]}, 8),
        ({"a": [None, [1]]}, 8),
        (5, 0),
    ],
)
def test_arrays_that_do_not_fit_the_bytes_are_errors(description, size):
    with pytest.raises((ValueError, TypeError, AttributeError)):
        restored(description, memoryview(bytes(size)))
