"""A rigid box turns over, again and again, as it spins about its intermediate axis.

A box of 1 x 2 x 3 spins without gravity about its axis of length 2, which is not stable. Cosmonaut Dzhanibekov saw a
wing nut do so in 1985. The times at which it turns over are compared with Euler's equations of a free rigid body.

Run it:  python examples/14_dzhanibekov.py
"""

import numpy as np
from scipy.integrate import solve_ivp

import supple as sp

SPIN = (0.5, 10.0, 0.5)


def spin_by_euler(inertia: np.ndarray, times: np.ndarray) -> np.ndarray:
    """(k, 3) angular velocities in the body's axes [rad/s]."""

    def rate(_: float, w: np.ndarray) -> np.ndarray:
        return -np.cross(w, inertia * w) / inertia

    return solve_ivp(rate, (0.0, times[-1]), SPIN, t_eval=times, rtol=1e-10, atol=1e-10).y.T


def turns(times: np.ndarray, along: np.ndarray) -> np.ndarray:
    """When the component along the axis changes its sign [s]."""
    k = np.flatnonzero(along[1:] * along[:-1] < 0)
    return times[k] + (times[k + 1] - times[k]) * along[k] / (along[k] - along[k + 1])


def main(steps: int = 600, sinks=()) -> dict[str, float]:
    block = sp.shapes.box_surface((0.1, 0.2, 0.3), (1, 1, 1))
    box = sp.RigidBody("box", block, density=1000.0, angular_velocity=SPIN, look="steel")
    momentum = np.diag(box.properties.inertia) * SPIN
    rest = np.linalg.norm(np.diff(block.vertices, axis=0), axis=1)
    times, along, change, strain = [0.0], [SPIN[1]], 0.0, 0.0
    solver = sp.XPBD(substeps=20, contact=None)
    for frame in sp.simulate(sp.Scene([box], gravity=(0, 0, 0)), solver, dt=1 / 120, steps=steps, sinks=sinks):
        pose = frame.poses["box"]
        times.append(frame.time)
        along.append(float((pose.rotation.T @ pose.angular_velocity)[1]))
        change = max(change, np.linalg.norm(frame.report.angular_momentum - momentum) / np.linalg.norm(momentum))
        lengths = np.linalg.norm(np.diff(frame.positions["box"], axis=0), axis=1)
        strain = max(strain, float(np.abs(lengths / rest - 1).max()))
    seen = turns(np.array(times), np.array(along))
    exact = turns(np.array(times), spin_by_euler(np.diag(box.properties.inertia), np.array(times))[:, 1])
    late = float(np.abs(seen / exact - 1).max()) if len(seen) == len(exact) else np.inf
    at = ", ".join(f"{time:.3f}" for time in seen)
    print(f"turns over at {at} s, at most {100 * late:.2g} % from Euler's equations")
    print(f"angular momentum changes by {change:.1e}, lengths by {strain:.1e}")
    return {"turns": len(seen), "late": late, "change": float(change), "strain": strain}


if __name__ == "__main__":
    main()
