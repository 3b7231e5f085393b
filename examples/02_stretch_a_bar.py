"""A rubber bar is stretched to one and a half times its length. How thin does it become?

Stable Neo-Hookean rubber of E = 100 kPa and nu = 0.4, stretched by 1.5 with free sides, has the lateral
stretch 0.84327 (the root of P22 = 0). Near the clamps it cannot contract; in the middle of a long bar it does.

Run it:  python examples/02_stretch_a_bar.py
"""

import numpy as np

import supple as sp


def main() -> float:
    length, width = 1.0, 0.1
    bar = sp.Body(
        "bar",
        sp.shapes.box(size=(length, width, width), divisions=(20, 2, 2)),
        sp.StableNeoHookean(youngs=1e5, poisson=0.4, density=1000.0, damping=0.002),
    )
    left = sp.Pin("bar", sp.InBox((-0.501, -1, -1), (-0.499, 1, 1)))
    pull = sp.Keyframes([0.0, 1.0], [[0, 0, 0], [0.5 * length, 0, 0]])
    right = sp.Pin("bar", sp.InBox((0.499, -1, -1), (0.501, 1, 1)), pull)
    scene = sp.Scene([bar], pins=[left, right], gravity=(0, 0, 0))

    *_, last = sp.simulate(scene, sp.XPBD(substeps=60), dt=1 / 60, steps=90)
    middle = np.abs(bar.mesh.vertices[:, 0]) < 1e-9
    thinning = float(np.ptp(last.positions["bar"][middle, 1])) / width
    print(f"stretched by 1.5, the middle thins to {thinning:.4f} of its width (free sides: 0.8433)")
    return thinning


if __name__ == "__main__":
    main()
