"""Which integrators hold joints and welds, and where welds may start."""

from __future__ import annotations

import numpy as np

from supple.errors import SceneError, SolverError
from supple.implicit.stepping.integrators import Integrator, Newmark, Static
from supple.scene.joints.axis_joint import AxisJoint
from supple.scene.joints.motors import VelocityMotor
from supple.scene.scene import Scene
from supple.state import State
from supple.system import System

# At the start, welded vertices are where round-off in what a user computed puts them. A share of the rigid body's size.
_OFF = 1e-6


def refuse_joints(method: Integrator, scene: Scene) -> None:
    """Check that an integrator holds the joints and welds of a scene.

    The midpoint rule makes bodies rigid in the middle of a step. At its end, joints and welds would hold bodies that
    are stretched: the energy of a double pendulum grew by a fifth.

    Raises
    ------
    SolverError : where it does not; the text names a joint or a weld.
    """
    held = [*scene.joints, *scene.welds]
    if held and isinstance(method, Newmark):
        what = "joints" if scene.joints else "welds"
        raise SolverError(
            f"{held[0].label}: the integrator 'newmark' does not support {what}; use 'bdf2', or 'backward_euler'"
        )
    for joint in scene.joints:
        if isinstance(method, Static) and isinstance(joint, AxisJoint) and isinstance(joint.motor, VelocityMotor):
            raise SolverError(
                f"{joint.label}: in an equilibrium nothing moves, and its motor has a velocity; give a PositionMotor, "
                "or use another integrator"
            )


def refuse_moved_welds(system: System, state: State) -> None:
    """Check that welded vertices are in their places on the rigid bodies where a simulation starts.

    Raises
    ------
    SceneError : where one is not; the text names the weld and the vertex.
    """
    welding, x = system.welding, state.positions
    if not len(welding):
        return
    there = np.einsum("sk,ski->si", welding.weights, x[welding.control])
    sizes = np.linalg.norm(np.ptp(x[welding.control], axis=1), axis=1)
    off = np.linalg.norm(x[welding.vertices] - there, axis=1)
    worst = int((off / sizes).argmax())
    if off[worst] > _OFF * sizes[worst]:
        weld = system.scene.welds[welding.weld[worst]]
        begin = next(part.vertices.start for part in system.bodies if part.name == weld.body)
        raise SceneError(
            f"{weld.label}: at the start vertex {welding.vertices[worst] - begin} is {off[worst]:.3g} m off its place "
            f"on body {weld.rigid!r}; move both bodies together"
        )
