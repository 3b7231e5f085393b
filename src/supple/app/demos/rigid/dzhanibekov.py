"""A rigid box that turns over, again and again, as it spins about its intermediate axis."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.app.demos.demo import Claim, Demo, Measurement
from supple.mesh import shapes
from supple.results.frame import Frame
from supple.scene.rigid.pose import orthogonality_error
from supple.scene.rigid.rigid_body import RigidBody
from supple.scene.scene import Scene
from supple.solvers.xpbd.solver import XPBD

SIZE = (0.1, 0.2, 0.3)
SPIN = (0.5, 10.0, 0.5)


def scene() -> Scene:
    """A box of 1 x 2 x 3 without gravity; it spins about its axis of length 2, not quite exactly."""
    box = RigidBody("box", shapes.box_surface(SIZE, (1, 1, 1)), density=1000.0, angular_velocity=SPIN, look="steel")
    return Scene([box], gravity=(0, 0, 0))


def spin_by_euler(inertia: NDArray[np.float64], times: NDArray[np.float64]) -> NDArray[np.float64]:
    """(k, 3) angular velocities in the body's axes at `times` [s], by Euler's equations of a free rigid body."""
    from scipy.integrate import solve_ivp

    def rate(_: float, w: NDArray[np.float64]) -> NDArray[np.float64]:
        return -np.cross(w, inertia * w) / inertia

    found = solve_ivp(rate, (0.0, float(times[-1])), SPIN, t_eval=times, rtol=1e-10, atol=1e-10)
    return found.y.T


def turns(times: NDArray[np.float64], along: NDArray[np.float64]) -> NDArray[np.float64]:
    """When the component along the axis changes its sign [s]."""
    k = np.flatnonzero(along[1:] * along[:-1] < 0.0)
    return times[k] + (times[k + 1] - times[k]) * along[k] / (along[k] - along[k + 1])


class _Measurement(Measurement):
    def values(self, frame: Frame) -> dict[str, Any]:
        pose = frame.poses["box"]
        return {
            **super().values(frame),
            "time": frame.time,
            "along": float((pose.rotation.T @ pose.angular_velocity)[1]),
            "L": frame.report.angular_momentum,
            "error": orthogonality_error(frame.system.rest_positions, frame.state.positions),
        }

    def claims(self) -> list[Claim]:
        body = self.first.system.bodies[0].body
        assert isinstance(body, RigidBody)
        times = np.concatenate([[0.0], self.series["time"]])
        inertia = np.diag(body.properties.inertia)
        exact = turns(times, spin_by_euler(inertia, times)[:, 1])
        found = turns(times, np.concatenate([[SPIN[1]], self.series["along"]]))
        same = len(found) == len(exact) >= 2
        late = float(np.abs(found / exact - 1.0).max()) if same else np.inf
        L, first = np.array(self.series["L"]), self.first.report.angular_momentum
        change = float(np.linalg.norm(L - first, axis=1).max() / np.linalg.norm(first))
        error = max(self.series["error"])
        text = ", ".join(f"{time:.3f} s" for time in found) or "never"
        return [
            Claim(
                "it turns over when Euler's equations say, within 1 %",
                f"{text}; largest difference {100 * late:.2g} %" if same else f"{text}; Euler: {exact.round(3)}",
                late <= 0.01,
            ),
            Claim("angular momentum is constant to 1e-10", f"largest change {change:.2g}", change <= 1e-10),
            Claim("it stays rigid to 1e-12", f"largest |F^T F - 1| {error:.2g}", error <= 1e-12),
        ]


DZHANIBEKOV = Demo(
    name="dzhanibekov",
    summary="a rigid box that turns over as it spins",
    explanation=(
        "A rigid box of 1 x 2 x 3 spins without gravity about its intermediate axis, which is not stable: after a "
        "while it turns over, and back again. Cosmonaut Dzhanibekov saw a wing nut do so in 1985. Its momentum never "
        "changes."
    ),
    scene=scene,
    solvers={"xpbd": lambda: XPBD(substeps=20, contact=None)},
    measurement=_Measurement,
    dt=1 / 120,
    steps=600,
)
