"""A tendon bends a finger with notches, and releases it.

The tendon runs through the pads between the notches to a winch in the wall. Its tension closes the notches; without it
the finger springs back.

Run it:  python examples/12_tendon_finger.py
"""

import numpy as np

import supple as sp

CELL, LENGTH, HEIGHT, WIDTH = 0.01, 16, 4, 3  # [m]; numbers of cells
TENSION, FULL, HELD, RELEASED = 3.0, 0.3, 0.7, 0.8


def finger() -> sp.TetMesh:
    """A bar along x with notches from below, every fourth cell, two cells deep."""
    cells = np.array([LENGTH, HEIGHT, WIDTH])
    mesh = sp.shapes.box(tuple(cells * CELL), tuple(cells.tolist()))
    vertices = mesh.vertices + 0.5 * cells * CELL
    i, j, _ = np.floor(vertices[mesh.tets].mean(axis=1) / CELL).astype(int).T
    tets = mesh.tets[~((i % 4 == 2) & (j < 2))]
    used, numbers = np.unique(tets, return_inverse=True)
    return sp.TetMesh(vertices[used], numbers.reshape(-1, 4))


def main(solver: sp.XPBD | sp.Implicit | None = None, sinks=()) -> dict[str, float]:
    low, middle = 0.5 * CELL, 0.5 * WIDTH * CELL
    eyelets = [("finger", (x * CELL, low, middle)) for x in (15.5, 12.5, 8.5, 4.5)]
    pull = sp.Curve([0.0, FULL, HELD, RELEASED], [0.0, TENSION, TENSION, 0.0])
    body = sp.Body("finger", finger(), sp.StableNeoHookean(youngs=1e5, poisson=0.4, damping=0.06))
    scene = sp.Scene(
        [body],
        pins=[sp.Pin("finger", sp.InBox((-1, -1, -1), (1e-6, 1, 1)), name="wall")],
        cables=[sp.Cable([*eyelets, (None, (-2 * CELL, low, middle))], tension=pull, name="tendon")],
        gravity=(0, 0, 0),
    )
    x = body.mesh.vertices[:, 0]
    front, back = (np.abs(x - at * CELL) < 1e-9 for at in (LENGTH, LENGTH - 1))  # the last cells keep their shape

    angles, work, damped = [], 0.0, 0.0
    held = {}
    for frame in sp.simulate(scene, solver or sp.Implicit(), dt=1 / 60, steps=80, sinks=sinks):
        along = frame.positions["finger"][front].mean(axis=0) - frame.positions["finger"][back].mean(axis=0)
        angles.append(float(np.degrees(np.arctan2(-along[1], along[0]))))
        if frame.time < HELD:
            work += frame.report.cables["tendon"].work
            damped -= frame.report.work["damping"]
            wall = float(np.linalg.norm(frame.reactions[scene.pins[0].label]))
            held = {"bent": angles[-1], "wall": wall / TENSION, "stored": frame.report.elastic_energy}
    print(f"{TENSION:g} N turn the tip by {held['bent']:.1f} degrees; released, {angles[-1]:.1f} degrees are left")
    print(f"of {1e3 * work:.3g} mJ of work, {1e3 * held['stored']:.3g} mJ are stored and {1e3 * damped:.3g} mJ damped")
    return {**held, "work": work, "damped": damped, "left": angles[-1]}


if __name__ == "__main__":
    main()
