"""All kinds of joints. A new kind is one file and one line here."""

from __future__ import annotations

from supple.scene.joints.axis_joint import HingeJoint, SliderJoint
from supple.scene.joints.ball_joint import BallJoint
from supple.scene.joints.fixed_joint import FixedJoint
from supple.scene.joints.joint import Joint
from supple.scene.joints.universal_joint import UniversalJoint

JOINTS: tuple[type[Joint], ...] = (
    FixedJoint,
    BallJoint,
    HingeJoint,
    SliderJoint,
    UniversalJoint,
)
