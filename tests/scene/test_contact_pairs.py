"""Rules for pairs of bodies and obstacles: their effect on the table, and which rules raise an error."""

import numpy as np
import pytest

import supple as sp
from supple.scene.contact_pairs import pair_table

RUBBER = sp.StableNeoHookean(youngs=1e5, poisson=0.4)
CUBE = sp.shapes.box(divisions=(1, 1, 1))


def scene(*pairs):
    bodies = [sp.Body(name, CUBE, RUBBER, friction=mu) for name, mu in (("a1", 0.4), ("a2", 0.9), ("b", 0.0))]
    obstacles = [sp.HalfSpace(friction=0.3, name="floor"), sp.obstacles.Sphere(friction=0.7)]
    return sp.Scene(bodies, obstacles, contact_pairs=pairs)


def test_friction_without_rules():
    table = pair_table(scene())
    assert table.bodies == 3
    assert np.array_equal(table.collide, block(3, 5))
    expected = np.zeros((5, 5))
    expected[:3, :3] = np.sqrt(np.outer([0.4, 0.9, 0.0], [0.4, 0.9, 0.0]))
    expected[:3, 3:] = [0.3, 0.7]
    expected[3:, :3] = [[0.3], [0.7]]
    assert np.array_equal(table.friction, expected)
    assert table.friction[0, 0] == pytest.approx(0.4, rel=1e-15)


def block(bodies, count):
    """True, except between two obstacles."""
    touch = np.ones((count, count), bool)
    touch[bodies:, bodies:] = False
    return touch


def test_a_rule_is_symmetric_and_changes_only_its_pair():
    plain, table = pair_table(scene()), pair_table(scene(sp.ContactPair("floor", "a2", friction=2.0)))
    assert table.friction[1, 3] == table.friction[3, 1] == 2.0
    changed = table.friction != plain.friction
    assert changed.sum() == 2
    assert np.array_equal(table.collide, plain.collide)


def test_lists_of_names_give_every_pair():
    table = pair_table(scene(sp.ContactPair(["a1", "a2"], ["a1", "b", "Sphere 1"], collide=False)))
    off = {(0, 0), (0, 1), (0, 2), (0, 4), (1, 2), (1, 4)}
    off |= {(j, i) for i, j in off}
    assert {(int(i), int(j)) for i, j in np.argwhere(~table.collide & block(3, 5))} == off


def test_wildcards_match_names():
    table = pair_table(scene(sp.ContactPair("a*", "floo?", friction=0.1), sp.ContactPair("b", "*", collide=False)))
    assert table.friction[:3, 3].tolist() == [0.1, 0.1, 0.3]
    assert not table.collide[2].any()
    assert table.collide[:2, :2].all()


def test_repeating_a_rule_is_allowed():
    pairs = sp.ContactPair("a1", "floor", friction=0.5), sp.ContactPair("floor", ["a1", "a2"], friction=0.5)
    assert pair_table(scene(*pairs)).friction[:3, 3].tolist() == [0.5, 0.5, 0.3]


BAD = [
    (lambda: sp.ContactPair("a1", "b"), "contact pair of 'a1' and 'b': it has no effect; give `friction`, or"),
    (lambda: sp.ContactPair("a1", "b", friction=-1), "friction is -1; it must be zero or more"),
    (lambda: sp.ContactPair("a1", "b", friction=np.nan), "friction is nan; it must be finite"),
    (lambda: sp.ContactPair("a1", "b", friction=0.2, collide=False), "a pair that does not collide; remove one of the"),
    (lambda: sp.ContactPair("a1", "b", collide=0), "collide is 0; give True or False"),
    (lambda: sp.ContactPair([], "b", collide=False), "first is empty; give a name or a list"),
    (lambda: sp.ContactPair("b", 7, collide=False), "second is 7; give a name or a list"),
    (lambda: sp.ContactPair("b", ["a1", None], collide=False), "second holds None; give names"),
    (lambda: scene("floor"), r"scene: contact_pairs\[0\] is a str; give a ContactPair"),
    (
        lambda: scene(sp.ContactPair("a1", "flor", collide=False)),
        "second: body or obstacle 'flor' does not exist; did you mean 'floor'",
    ),
    (
        lambda: scene(sp.ContactPair("zz", "b", collide=False)),
        "first: body or obstacle 'zz' does not exist; there are 'a1', 'a2', 'b'",
    ),
    (lambda: scene(sp.ContactPair("c*", "b", collide=False)), r"first: body or obstacle 'c\*' does not exist"),
    (
        lambda: scene(sp.ContactPair(["b", "floor"], "Sphere 1", collide=False)),
        "'floor' and 'Sphere 1' are both obstacles, which never touch",
    ),
    (
        lambda: scene(sp.ContactPair("a*", "b", collide=False), sp.ContactPair("b", "a2", friction=0.1)),
        r"contact pair of 'b' and 'a2': contact pair 0 \(from 0\) contradicts it for 'b' and 'a2'; keep one",
    ),
    (
        lambda: scene(sp.ContactPair("a1", "b", friction=0.2), sp.ContactPair("b", "a1", friction=0.1)),
        "contradicts it for 'b' and 'a1'",
    ),
]


@pytest.mark.parametrize(("make", "message"), BAD, ids=[message[-40:] for _, message in BAD])
def test_impossible_rules_raise_a_one_line_error(make, message):
    with pytest.raises(sp.SceneError, match=message):
        make()
