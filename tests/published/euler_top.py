"""A free rigid body with the principal moments 2, 3 and 4 kg m^2 turns about no axis of symmetry. Euler (1758) wrote
its equations; Landau and Lifshitz, "Mechanics", section 37, have the solution: the angular velocity in the body is of
Jacobi's elliptic functions cn, sn and dn of the time.
"""

from typing import Any

import numpy as np
from scipy.special import ellipj
from tests.published.case import DYNAMIC, Case, Reference, Solution, simulated

import supple as sp

I1, I2, I3 = 2.0, 3.0, 4.0
SPIN = np.array([2.0, 0.0, 1.5])  # rad/s
END = 4.0


def exact(t):
    """The angular velocity in the body [rad/s]."""
    twice_energy, square = I1 * SPIN[0] ** 2 + I3 * SPIN[2] ** 2, (I1 * SPIN[0]) ** 2 + (I3 * SPIN[2]) ** 2
    one, three = twice_energy * I3 - square, square - twice_energy * I1
    assert square > twice_energy * I2
    rate = np.sqrt((I3 - I2) * three / (I1 * I2 * I3))
    sn, cn, dn, _ = ellipj(t * rate, (I2 - I1) * one / ((I3 - I2) * three))
    sizes = [np.sqrt(x) for x in (one / (I1 * (I3 - I1)), one / (I2 * (I3 - I2)), three / (I3 * (I3 - I1)))]
    return sizes[0] * cn, sizes[1] * sn, sizes[2] * dn


def solve(dt):
    box = sp.shapes.box_surface((1.5, 1.0, 0.5), (1, 1, 1))
    scene = sp.Scene(
        [sp.RigidBody("top", box, mass=6.0, inertia=(I1, I2, I3), angular_velocity=SPIN)], gravity=(0, 0, 0)
    )
    values: dict[str, Any] = {}
    frame: Any = None
    for name, solver in DYNAMIC.items():
        *_, frame = simulated(scene, solver, dt, END)
        pose = frame.poses["top"]
        values[f"spin after 4 s, {name}"] = pose.rotation.T @ pose.angular_velocity
    return Solution(values, frame)


CASE = Case(
    title="Euler's top",
    source="Euler 1758",
    references={f"spin after 4 s, {name}": Reference(exact(END), "rad/s") for name in DYNAMIC},
    solve=solve,
    meshes=(1 / 50, 1 / 200),
    differs="Coarse and fine are steps of 1/50 and 1/200 s.",
)
