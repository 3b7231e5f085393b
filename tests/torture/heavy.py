"""A heavy cube on a light one: ten times the size, ten thousand times the density, ten million times the mass."""

from tests.torture.watch import ContactMeasurement, Size, mass, push, torture

from supple.app.demos.demo import Claim
from supple.materials.elastic import StableNeoHookean
from supple.mesh import shapes
from supple.scene.body import Body
from supple.scene.obstacles.half_space import HalfSpace
from supple.scene.scene import Scene

SIDE, DENSITY, GAP = 0.1, 1.0, 1e-3
GRAVITY = 9.81


def scene(cells: int) -> Scene:
    """A cube of 1 g on a floor, and 1 mm above it one of 10 t."""
    small = shapes.box((SIDE,) * 3, (cells,) * 3)
    # Five cells along each edge, so that the light cube stands under the middle cell.
    large = shapes.box((10 * SIDE,) * 3, (5,) * 3)
    light = StableNeoHookean(youngs=2e9, poisson=0.3, density=DENSITY, damping=0.02)
    heavy = StableNeoHookean(youngs=2e9, poisson=0.3, density=1e4 * DENSITY, damping=0.02)
    return Scene(
        bodies=[
            Body("light", small, light, position=(0, SIDE / 2 + GAP, 0)),
            Body("heavy", large, heavy, position=(0, 6 * SIDE + 2 * GAP, 0)),
        ],
        obstacles=[HalfSpace(name="floor", friction=0.3)],
        gravity=(0, -GRAVITY, 0),
    )


class _Measurement(ContactMeasurement):
    def own_claims(self) -> list[Claim]:
        heavy, light = GRAVITY * mass(self.last, "heavy"), GRAVITY * mass(self.last, "light")
        on_light = push(self.last, "heavy", "light") / heavy
        on_floor = push(self.last, "light", "floor") / (heavy + light)
        lowest = float(self.last.positions["heavy"][:, 1].min()) / SIDE
        return [
            Claim(
                "at the end the light cube, and the floor, carry the weight within 2 %",
                f"{100 * on_light:.2f} % and {100 * on_floor:.2f} % of it",
                abs(on_light - 1) <= 0.02 and abs(on_floor - 1) <= 0.02,
            ),
            Claim(
                "the light cube keeps its height within 10 %",
                f"{100 * lowest:.1f} % of it",
                0.9 <= lowest <= 1.01,
            ),
        ]


HEAVY = torture(
    name="heavy",
    summary="ten tonnes on a cube of one gram",
    explanation=(
        "A cube of 1 m and 10,000 kg/m^3 falls by a millimetre on a cube of 10 cm and 1 kg/m^3 (both E = 2 GPa): "
        "ten million times the mass."
    ),
    scene=scene,
    measurement=_Measurement,
    small=Size((2,), 1 / 100, 30),
    full=Size((4,), 1 / 100, 60),
)
