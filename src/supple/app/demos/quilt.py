"""A soft patch stitched to a stiff bar that is bent: both solvers against the static equilibrium."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.app.demos.demo import Claim, Demo, Measurement, stitch_lengths
from supple.materials.elastic import StableNeoHookean
from supple.mesh import shapes
from supple.scene.body import Body
from supple.scene.forces import Force
from supple.scene.pins import Pin
from supple.scene.scene import Scene
from supple.scene.selection import InBox
from supple.scene.stitches.vertex_triangle import SoftVertexTriangleStitch
from supple.simulate import simulate
from supple.solvers.implicit.solver import Implicit
from supple.solvers.xpbd.solver import XPBD

LENGTH, LOAD, RAMP = 0.6, 16.0, 2.0
BAR_DIVISIONS, PATCH_DIVISIONS = (12, 2, 3), (9, 1, 4)
GAP = 0.005  # between bar and patch


def load(time: float) -> NDArray[np.float64]:
    """The force on the bar's end [N]: it grows during `RAMP` seconds; its second derivative is continuous."""
    s = min(time / RAMP, 1.0)
    return np.array([0.0, -LOAD * s**3 * (10.0 - 15.0 * s + 6.0 * s * s), 0.0])


def scene() -> Scene:
    """A bar of 2 MPa, held at one end, pulled down at the other; on top of it, a patch of 0.2 MPa."""
    bar = Body(
        "bar",
        shapes.box((LENGTH, 0.06, 0.12), BAR_DIVISIONS),
        StableNeoHookean(youngs=2e6, poisson=0.3, damping=0.02),
    )
    patch = Body(
        "patch",
        shapes.box((0.3, 0.03, 0.12), PATCH_DIVISIONS),
        StableNeoHookean(youngs=2e5, poisson=0.4, damping=0.02),
        position=(0, 0.03 + GAP + 0.015, 0),
    )
    seam = SoftVertexTriangleStitch(
        "patch", "bar", max_distance=1.1 * GAP, youngs=2e5, poisson=0.3, damping=0.02, name="seam"
    )
    end = 0.5 * LENGTH - 1e-9
    return Scene(
        bodies=[bar, patch],
        pins=[Pin("bar", InBox((-1, -1, -1), (-end, 1, 1)), name="wall")],
        forces=[Force("bar", InBox((end, -1, -1), (1, 1, 1)), load, name="load")],
        stitches=[seam],
        gravity=(0, 0, 0),
    )


def static_shape() -> NDArray[np.float64]:
    """(n, 3) positions at rest under the whole load, computed by the implicit solver [m]."""
    *_, frame = simulate(scene(), Implicit(integrator="static"), 2.0 * RAMP, 1)
    return frame.state.positions


class _Measurement(Measurement):
    def claims(self) -> list[Claim]:
        start, end, exact = self.first.state.positions, self.last.state.positions, static_shape()
        deflection = float(np.linalg.norm(exact - start, axis=1).max())
        off = float(np.linalg.norm(end - exact, axis=1).max())
        apart = float(np.abs(stitch_lengths(self.last) - stitch_lengths(self.first)).max())
        report = self.last.report
        return [
            Claim(
                "bar and patch come to rest in the static shape, within 2 % of the deflection",
                f"at most {1e3 * off:.2f} mm off, {100 * off / deflection:.2f} % of {1e3 * deflection:.1f} mm",
                off <= 0.02 * deflection,
            ),
            Claim(
                "the stitches hold: the patch stays within 2 mm of where it was stitched",
                f"at most {1e3 * apart:.2f} mm, largest stretch of a stitch {report.largest_stitch_stretch:.3f}",
                apart <= 2e-3 and end[:, 1].min() < -0.5 * deflection,
            ),
            Claim(
                "the energy of the stitches is above zero and below 5 % of the bodies'",
                f"{1e3 * report.stitch_energy:.3g} mJ of {1e3 * report.elastic_energy:.3g} mJ",
                0.0 < report.stitch_energy < 0.05 * report.elastic_energy,
            ),
        ]


QUILT = Demo(
    name="quilt",
    summary="a soft patch stitched to a stiff bar, which is bent",
    explanation=(
        "A patch (E = 0.2 MPa) is stitched to a bar that is ten times as stiff, by tetrahedra between its lower "
        "vertices and the bar's upper triangles. A force of 16 N pulls the end of the bar down. For either solver, "
        "the shape at rest is compared with the static equilibrium."
    ),
    scene=scene,
    solvers={"xpbd": lambda: XPBD(substeps=80), "implicit": Implicit},
    measurement=_Measurement,
    steps=240,
)
