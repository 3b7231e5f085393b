"""Twenty rigid dominoes in a row: the first is pushed, and each one knocks over the next.

The rate of the wave soon becomes steady. Surfaces never touch, and energy never grows.

Run it:  python examples/13_dominoes.py
"""

import numpy as np

import supple as sp

SIZE, SPACING = (0.008, 0.05, 0.025), 0.025
PUSH, FRICTION = 3.0, 0.4
LEANING = 0.05  # a domino counts as hit once it leans by this angle [rad]


def scene(count: int) -> sp.Scene:
    """Dominoes of 8 x 50 x 25 mm, 25 mm apart; the first begins with an angular velocity about its edge."""
    tile = sp.shapes.box_surface(SIZE, (1, 1, 1))
    spin, arm = np.array([0.0, 0.0, -PUSH]), np.array([SIZE[0] / 2, -SIZE[1] / 2, 0.0])
    bodies = []
    for k in range(count):
        place = (k * SPACING, SIZE[1] / 2 + 2e-5, 0.0)
        push = {"angular_velocity": spin, "velocity": -np.cross(spin, arm)} if k == 0 else {}
        bodies.append(sp.RigidBody(f"domino {k + 1}", tile, density=1200.0, position=place, friction=FRICTION, **push))
    return sp.Scene(bodies, obstacles=[sp.HalfSpace(friction=FRICTION, name="floor")])


def main(count: int = 20, steps: int = 600, sinks=()) -> dict[str, float]:
    row = scene(count)
    weight = 9.81 * sum(body.properties.mass for body in row.bodies)
    lean, times, energies, distances = [], [], [], []
    for frame in sp.simulate(row, sp.Implicit(), dt=1 / 480, steps=steps, sinks=sinks):
        up = np.array([pose.rotation[:, 1] for pose in frame.poses.values()])
        lean.append(np.arctan2(up[:, 0], up[:, 1]))
        times.append(frame.time)
        report = frame.report
        energies.append(report.kinetic_energy + report.potential_energy + report.elastic_energy)
        distances += [] if report.min_distance is None else [report.min_distance]
    fallen = int((np.abs(lean[-1]) > 1.0).sum())
    hit = [times[int(np.argmax(one > LEANING))] for one in np.array(lean).T if one.max() > LEANING]
    between = np.diff(hit)[len(hit) // 2 :]
    gain = (max(energies) - energies[0]) / (weight * SIZE[1] / 2)
    print(f"{fallen} of {count} fall, in the second half one every {1e3 * between.mean():.1f} ms")
    print(f"surfaces stay {min(distances):.2g} m apart; energy grows by at most {100 * gain:.2g} % of the fall")
    return {
        "fallen": fallen,
        "spread": float(np.ptp(between) / between.mean()),
        "gain": float(gain),
        "nearest": float(min(distances)),
    }


if __name__ == "__main__":
    main()
