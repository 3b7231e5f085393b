"""A doll of soft limbs on hinged bones falls on the floor and comes to rest.

Ten soft boxes have rigid bones, to which their inner vertices are welded. Balls join the bones at neck, shoulders and
hips, hinges with limits at elbows and knees.

Run it:  python examples/15_ragdoll.py
"""

import numpy as np

import supple as sp

# Center and size [m] of the flesh in the middle and on the doll's right, where x is positive.
MIDDLE = {"torso": ((0, 0.75, 0), (0.2, 0.3, 0.1)), "head": ((0, 0.98, 0), (0.1, 0.12, 0.1))}
RIGHT = {
    "upper arm": ((0.19, 0.86, 0), (0.16, 0.05, 0.05)),
    "lower arm": ((0.36, 0.86, 0), (0.16, 0.05, 0.05)),
    "thigh": ((0.055, 0.48, 0), (0.08, 0.22, 0.08)),
    "shin": ((0.055, 0.25, 0), (0.06, 0.22, 0.06)),
}
LIMITS = (-0.05, 2.2)


def scene() -> sp.Scene:
    parts = dict(MIDDLE)
    joints: list = [sp.BallJoint("head bone", "torso bone", point=(0, 0.91, 0), name="neck")]
    for side, s in (("right", 1.0), ("left", -1.0)):
        parts |= {f"{side} {name}": ((s * c[0], c[1], c[2]), size) for name, (c, size) in RIGHT.items()}
        for part, name, at in (
            ("upper arm", "shoulder", (s * 0.105, 0.86, 0)),
            ("thigh", "hip", (s * 0.055, 0.595, 0)),
        ):
            joints.append(sp.BallJoint(f"{side} {part} bone", "torso bone", point=at, name=f"{side} {name}"))
        for first, second, name, at, axis in (
            ("lower arm", "upper arm", "elbow", (s * 0.275, 0.86, 0), (0, -s, 0)),
            ("shin", "thigh", "knee", (s * 0.055, 0.365, 0), (1, 0, 0)),
        ):
            both = (f"{side} {first} bone", f"{side} {second} bone")
            joints.append(sp.HingeJoint(*both, point=at, axis=axis, limits=LIMITS, damping=0.02, name=f"{side} {name}"))
    flesh = sp.StableNeoHookean(youngs=1e5, poisson=0.3, density=900.0, damping=0.01)
    throw, bodies, welds = {"velocity": (0.3, 0.0, 0.8)}, [], []
    for name, (center, size) in parts.items():
        cells = tuple(4 if length > 0.12 else 2 for length in size)
        core = np.where(np.array(size) > 0.12, 0.6, 0.3) * size
        bone = sp.shapes.box_surface(tuple(core), (1, 1, 1))
        bodies.append(sp.Body(name, sp.shapes.box(size, cells), flesh, position=center, friction=0.5, **throw))
        bodies.append(sp.RigidBody(f"{name} bone", bone, density=1800.0, position=center, **throw))
        welds.append(sp.Weld(name, f"{name} bone", sp.InBox(center - 0.51 * core, center + 0.51 * core), name=name))
    covered = sp.ContactPair("* bone", "*", collide=False)  # bones are inside of flesh
    floor = sp.HalfSpace(friction=0.5, name="floor")
    return sp.Scene(bodies, obstacles=[floor], joints=joints, welds=welds, contact_pairs=[covered])


def main(steps: int = 200, sinks=()) -> dict[str, float]:
    doll, violation, beyond, carried = scene(), 0.0, -np.inf, []
    for frame in sp.simulate(doll, sp.Implicit(), dt=1 / 100, steps=steps, sinks=sinks):
        joints = frame.report.joints.values()
        violation = max(violation, *(joint.violation for joint in joints))
        angles = np.array([joint.coordinate for joint in joints if joint.coordinate is not None])
        beyond = max(beyond, float(np.maximum(LIMITS[0] - angles, angles - LIMITS[1]).max()))
        carried.append(-frame.report.details.contact_forces["floor"][1])
    share = float(np.mean(carried[-steps // 10 :]) / (9.81 * frame.system.masses.sum()))
    print(f"joints are violated by {violation:.1e} of a bone's size, limits by {max(beyond, 0.0):.1e} rad")
    print(f"at the end the floor carries {100 * share:.1f} % of the weight")
    return {"violation": violation, "beyond": beyond, "share": share}


if __name__ == "__main__":
    main()
