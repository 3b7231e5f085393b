"""Two blocks on a slope: one stays, one slides as far as Coulomb's law predicts."""

import numpy as np
from scipy.optimize import brentq
from tests.torture.watch import ContactMeasurement, Size, center, torture

from supple.app.demos.demo import Claim
from supple.materials.elastic import StableNeoHookean
from supple.mesh import shapes
from supple.scene.body import Body
from supple.scene.contact_pairs import ContactPair
from supple.scene.obstacles.half_space import HalfSpace
from supple.scene.scene import Scene
from supple.solvers.implicit.contact.settings import IPCContact
from supple.solvers.implicit.solver import Implicit

ANGLE = float(np.radians(26.565))
SIZE = (0.2, 0.1, 0.2)
GRAVITY = 9.81
SECONDS = 2.5
DENSITY = 1000.0
# Where contact begins [m], the stiffness of its barrier [Pa], and the velocity below which friction is static [m/s].
DHAT, STIFFNESS, SLOW = 1e-5, 1e7, 1e-4
COEFFICIENTS = {"sticks": 0.5, "slides": 0.49}
DOWN = np.array([1.0, 0.0, 0.0])


def resting_gap() -> float:
    """The distance [m] at which the barrier's pressure carries a block.

    Friction with mu = tan(angle) only just balances gravity: it would never stop a block that lands with some speed.
    """
    pressure = DENSITY * GRAVITY * np.cos(ANGLE) * SIZE[1]

    def surplus(share: float) -> float:
        """-b'(d) of b = -(s - 1)^2 ln s, s = (d / dhat)^2, less the pressure over the stiffness."""
        s = share**2
        return 2 * share * (2 * (s - 1) * np.log(s) + (s - 1) ** 2 / s) - pressure / STIFFNESS

    return DHAT * brentq(surplus, 0.5, 1.0, xtol=1e-15)  # pyright: ignore[reportReturnType, reportOperatorIssue]


def scene(cells: int) -> Scene:
    """Two blocks at rest side by side; the slope is horizontal, and gravity is tilted by 26.565 degrees."""
    mesh = shapes.box(SIZE, (2 * cells, cells, 2 * cells))
    material = StableNeoHookean(youngs=1e9, poisson=0.3, density=DENSITY)
    bodies = [
        Body(name, mesh, material, position=(0, SIZE[1] / 2 + resting_gap(), 0.4 * k))
        for k, name in enumerate(COEFFICIENTS)
    ]
    return Scene(
        bodies=bodies,
        obstacles=[HalfSpace(name="slope")],
        contact_pairs=[ContactPair(name, "slope", friction=mu) for name, mu in COEFFICIENTS.items()],
        gravity=GRAVITY * np.array([np.sin(ANGLE), -np.cos(ANGLE), 0.0]),
    )


class _Measurement(ContactMeasurement):
    def own_claims(self) -> list[Claim]:
        time = self.last.time
        ways = {name: center(self.last, name) - center(self.first, name) for name in COEFFICIENTS}
        slack = np.sin(ANGLE) - COEFFICIENTS["slides"] * np.cos(ANGLE)
        expected = 0.5 * GRAVITY * slack * SECONDS**2
        stuck, slid = float(abs(ways["sticks"] @ DOWN)), float(ways["slides"] @ DOWN)
        return [
            Claim(
                f"with mu = 0.5 the block creeps by less than eps_v t, eps_v = {SLOW:g} m/s",
                f"{1e6 * stuck:.3g} um in {time:.3g} s, eps_v t is {1e6 * SLOW * time:.3g} um",
                stuck <= SLOW * time,
            ),
            Claim(
                f"with mu = 0.49 it slides {expected:.4f} m in {SECONDS:g} s within 2 %",
                f"{slid:.4f} m in {time:.4g} s, {100 * (slid / expected - 1):+.2g} %",
                abs(time - SECONDS) < 1e-9 and abs(slid / expected - 1) <= 0.02,
            ),
        ]


SLOPE = torture(
    name="slope",
    summary="a block sticks to a slope at mu = 0.5, and slides at 0.49 as far as Coulomb's law predicts",
    explanation=(
        "Two stiff blocks (E = 1 GPa) on a slope of 26.565 degrees, whose tangent is 0.5. One has the friction "
        "coefficient 0.5, the other 0.49."
    ),
    scene=scene,
    solver=lambda: Implicit(contact=IPCContact(dhat=DHAT, stiffness=STIFFNESS, friction_velocity=SLOW)),
    measurement=_Measurement,
    small=Size((1,), 1 / 40, round(40 * SECONDS)),
    full=Size((2,), 1 / 100, round(100 * SECONDS)),
)
