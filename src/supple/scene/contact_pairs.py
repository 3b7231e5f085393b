"""Which bodies and obstacles touch, and with which friction coefficient. Both solvers use this file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import Annotated, Any, ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from supple.errors import SceneError
from supple.kinds.kind import Kind
from supple.kinds.suggestion import suggestion
from supple.kinds.validators import NON_NEGATIVE, Boolean, Validator
from supple.scene.body import PlacedBody
from supple.scene.joints.joint import Joint
from supple.scene.located import at
from supple.scene.obstacles.obstacle import Obstacle
from supple.scene.rigid.rigid_body import RigidBody


@dataclass(frozen=True)
class NameList(Validator):
    """A name, or a list of names, which may have `*` and `?`."""

    def checked(self, value: Any, what: str) -> tuple[str, ...]:
        try:
            names = (value,) if isinstance(value, str) else tuple(value)
        except TypeError:
            raise SceneError(f"{what} is {value!r}; give a name or a list of names") from None
        if not names:
            raise SceneError(f"{what} is empty; give a name or a list of names")
        for name in names:
            if not isinstance(name, str) or not name:
                raise SceneError(f"{what} holds {name!r}; give names of bodies and obstacles")
        return names


@dataclass(frozen=True, eq=False)
class ContactPair(Kind):
    """A rule for the contact of two bodies, of a body and an obstacle, or of a body with itself.

    Parameters
    ----------
    first, second : name of a body or an obstacle, or a list of names: then the rule holds for every pair of one of the
        first and one of the second. `*` matches any letters, `?` any one letter. A body paired with itself is its
        contact with itself.
    friction : Coulomb coefficient of these pairs, instead of those of the bodies and obstacles.
    collide : if False, these pairs may penetrate.

    Raises
    ------
    SceneError : where a value is of the wrong kind, or the rule has no effect.
    """

    kind: ClassVar[str] = "contact_pair"

    first: Annotated[str | Sequence[str], NameList()]
    second: Annotated[str | Sequence[str], NameList()]
    friction: Annotated[float | None, NON_NEGATIVE] = None
    collide: Annotated[bool, Boolean()] = True

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.friction is not None and not self.collide:
            raise SceneError(f"{self.label}: friction of a pair that does not collide; remove one of the two")
        if self.friction is None and self.collide:
            raise SceneError(f"{self.label}: it has no effect; give `friction`, or `collide` as false")

    @property
    def label(self) -> str:
        """The name of this rule in messages."""
        return f"contact pair of {_listed(self.first)} and {_listed(self.second)}"


@dataclass(frozen=True, eq=False)
class PairTable:
    """Contact of each pair of p bodies and obstacles: bodies in the scene's order, then obstacles in the scene's order.

    Attributes
    ----------
    collide : (p, p) whether the two touch; on the diagonal: whether a body touches itself
    friction : (p, p) Coulomb coefficients
    bodies : number of bodies among the p

    Both arrays are symmetric. Two obstacles do not touch: False and 0. A rigid body does
    not touch itself.
    """

    collide: NDArray[np.bool_]
    friction: NDArray[np.float64]
    bodies: int


class HasContactPairs(Protocol):
    """What this file uses of a scene."""

    @property
    def bodies(self) -> Sequence[PlacedBody]: ...
    @property
    def obstacles(self) -> Sequence[Obstacle]: ...
    @property
    def contact_pairs(self) -> Sequence[ContactPair]: ...
    @property
    def joints(self) -> Sequence[Joint]: ...


def pair_table(scene: HasContactPairs) -> PairTable:
    """Which bodies and obstacles of a scene touch, and with which friction coefficient.

    Without a rule everything touches, except what joints join with `collide=False`. An obstacle's coefficient holds for
    all bodies. Two bodies, or a body and itself, use the geometric mean of their coefficients.

    Raises
    ------
    SceneError : where a rule names an unknown thing, pairs two obstacles, or contradicts an earlier one.
    """
    names = [body.name for body in scene.bodies] + [str(obstacle.name) for obstacle in scene.obstacles]
    bodies, count = len(scene.bodies), len(names)
    own = np.array([body.friction for body in scene.bodies], dtype=np.float64)
    theirs = np.array([obstacle.friction for obstacle in scene.obstacles], dtype=np.float64)
    collide = np.ones((count, count), dtype=np.bool_)
    collide[bodies:, bodies:] = False
    for k, body in enumerate(scene.bodies):
        collide[k, k] = not isinstance(body, RigidBody)  # its parts do not move against each other
    friction = np.zeros((count, count))
    friction[:bodies, :bodies] = np.sqrt(np.outer(own, own))
    friction[:bodies, bodies:] = theirs
    friction[bodies:, :bodies] = theirs[:, None]
    rule = np.full((count, count) if scene.contact_pairs else 0, -1, dtype=np.int32)
    for number, pair in enumerate(scene.contact_pairs):
        with at("contact_pairs", number):
            first, second = _found(pair, "first", names), _found(pair, "second", names)
            if first[-1] >= bodies and second[-1] >= bodies:
                raise SceneError(
                    f"{pair.label}: {names[first[-1]]!r} and {names[second[-1]]!r} are both obstacles, which never "
                    "touch each other; name a body in `first` or in `second`, and no obstacle there"
                )
            before = rule[np.ix_(first, second)]
            for earlier in np.unique(before[before >= 0]):
                other = scene.contact_pairs[earlier]
                if (other.friction, other.collide) != (pair.friction, pair.collide):
                    i, j = np.argwhere(before == earlier)[0]
                    a, b = names[first[i]], names[second[j]]
                    raise SceneError(
                        f"{pair.label}: contact pair {earlier} (from 0) contradicts it for {a!r} and {b!r}; keep one"
                    )
        for block in (np.ix_(first, second), np.ix_(second, first)):
            rule[block] = number
            if pair.friction is None:
                collide[block] = False
            else:
                friction[block] = pair.friction
    for joint in scene.joints:
        if joint.second is not None and not joint.collide:
            i, j = names.index(joint.first), names.index(joint.second)
            collide[i, j] = collide[j, i] = False
    return PairTable(collide, friction, bodies)


def _found(pair: ContactPair, key: str, names: list[str]) -> list[int]:
    """Numbers of the bodies and obstacles that one side of a rule names, ascending."""
    numbers: set[int] = set()
    for name in getattr(pair, key):
        found = [i for i, known in enumerate(names) if _matches(name, known)]
        if not found:
            raise SceneError(
                f"{pair.label}: {key}: body or obstacle {name!r} does not exist; {suggestion(name, names)}"
            )
        numbers.update(found)
    return sorted(numbers)


def _matches(pattern: str, name: str) -> bool:
    """Whether a name matches. Names contain no `*` and no `?`; they may contain `[`, which is not a pattern here."""
    if "*" in pattern or "?" in pattern:
        return fnmatchcase(name, pattern.replace("[", "[[]"))
    return pattern == name


def _listed(given: object) -> str:
    names = tuple(given) if isinstance(given, (tuple, list)) else (given,)
    return ", ".join(map(repr, names[:3])) + (", ..." if len(names) > 3 else "")
