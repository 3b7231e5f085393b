"""A soft patch is stitched to a bar that is ten times as stiff, and the bar is bent.

Soft tetrahedra between the lower vertices of the patch and the upper triangles of the bar hold both together. A force
of 16 N that grows in two seconds pulls the end of the bar down. The shape at rest is compared with the static
equilibrium.

Run it:  python examples/08_quilt.py
"""

import numpy as np

import supple as sp

LENGTH, GAP, LOAD = 0.6, 0.005, 16.0
BAR, PATCH = (12, 2, 3), (9, 1, 4)  # numbers of cells


def scene(bar_cells: tuple[int, int, int] = BAR, patch_cells: tuple[int, int, int] = PATCH, ramp: float = 2.0):
    def load(time: float) -> np.ndarray:
        s = min(time / ramp, 1.0)
        return np.array([0.0, -LOAD * s**3 * (10 - 15 * s + 6 * s * s), 0.0])  # its second derivative is continuous

    stiff = sp.StableNeoHookean(youngs=2e6, poisson=0.3, damping=0.02)
    soft = sp.StableNeoHookean(youngs=2e5, poisson=0.4, damping=0.02)
    bar = sp.Body("bar", sp.shapes.box((LENGTH, 0.06, 0.12), bar_cells), stiff)
    patch = sp.Body("patch", sp.shapes.box((0.3, 0.03, 0.12), patch_cells), soft, position=(0, 0.045 + GAP, 0))
    end = LENGTH / 2 - 1e-9
    return sp.Scene(
        [bar, patch],
        pins=[sp.Pin("bar", sp.InBox((-1, -1, -1), (-end, 1, 1)), name="wall")],
        forces=[sp.Force("bar", sp.InBox((end, -1, -1), (1, 1, 1)), load, name="load")],
        stitches=[
            sp.SoftVertexTriangleStitch(
                "patch", "bar", max_distance=1.1 * GAP, youngs=2e5, poisson=0.3, damping=0.02, name="seam"
            )
        ],
        gravity=(0, 0, 0),
    )


def main(solver: sp.XPBD | sp.Implicit | None = None, steps: int = 240, sinks=(), **shape) -> dict[str, float]:
    quilt = scene(**shape)
    *_, exact = sp.simulate(quilt, sp.Implicit(integrator="static"), dt=10.0, steps=1)
    *_, last = sp.simulate(quilt, solver or sp.XPBD(substeps=80), dt=1 / 60, steps=steps, sinks=sinks)
    start = last.system.rest_positions
    deflection = np.linalg.norm(exact.state.positions - start, axis=1).max()
    off = np.linalg.norm(last.state.positions - exact.state.positions, axis=1).max()
    report = last.report
    print(f"at most {1e3 * off:.2f} mm from the static shape, {100 * off / deflection:.2f} % of the deflection")
    print(f"the stitches stretch by at most {report.largest_stitch_stretch:.3f}")
    return {
        "off": float(off / deflection),
        "deflection": float(deflection),
        "stretch": report.largest_stitch_stretch,
        "energy": report.stitch_energy / report.elastic_energy,
    }


if __name__ == "__main__":
    main()
