"""A universal joint: a cross with two pins, one in each of two bodies (Cardan's, or Hooke's, joint)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SceneError
from supple.kinds.forms import POSITIVE, Direction
from supple.scene.joints.ball_joint import check_swing
from supple.scene.joints.conditions import Conditions, Function
from supple.scene.joints.joint import Joint


@dataclass(frozen=True, eq=False)
class UniversalJoint(Joint):
    """Two bodies that share a point and two perpendicular axes about which they turn; see `Joint`.

    Each axis moves with one of the bodies, and they stay perpendicular. No other turn is free: the joint carries the
    torque about the normal of both axes, as between two shafts.

    Parameters
    ----------
    axis : (3,) the axis that moves with the first, in the world where the scene places everything, of any length [-].
    second_axis : (3,) the axis that moves with the second, perpendicular to the other there, of any length [-].
    max_swing : the largest angle between the shafts, the normals of both axes on the two bodies, from 0.01 to
        pi - 0.01 [rad]. The coordinate is this angle. None: no limit, and no coordinate.

    Raises
    ------
    SceneError : where a value is of the wrong kind or out of range, there is no point, both ends are one body, or the
        axes are not perpendicular.
    """

    kind: ClassVar[str] = "universal"
    required: ClassVar[tuple[str, ...]] = ("point",)

    axis: Annotated[ArrayLike, Direction()] = (1.0, 0.0, 0.0)
    second_axis: Annotated[ArrayLike, Direction()] = (0.0, 0.0, 1.0)
    max_swing: Annotated[float | None, POSITIVE] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        cosine = float(np.dot(np.asarray(self.axis), np.asarray(self.second_axis)))
        if abs(cosine) > 1e-9:
            raise SceneError(
                f"{self.label}: axis and second_axis are at {np.degrees(np.arccos(cosine)):.6g} degrees; give "
                "perpendicular ones"
            )
        if self.max_swing is not None:
            check_swing(self.max_swing, self.label)

    def axes(self) -> NDArray[np.float64]:
        first, second = np.asarray(self.axis), np.asarray(self.second_axis)
        return np.array([first, second, np.cross(first, second)])

    def conditions(self) -> Conditions:
        functions = [Function("product", ("first.0", "second.1"), vanishes=True)]
        if self.max_swing is not None:
            functions.append(Function("cosine", ("first.2", "second.2"), (0.0, self.max_swing)))
        return Conditions(functions=tuple(functions), lines=("first.0", "second.1"))
