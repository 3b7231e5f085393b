"""All torture scenes by name. A new one is one file and one line here."""

from tests.torture.aligned import ALIGNED
from tests.torture.arch import ARCH
from tests.torture.funnel import FUNNEL
from tests.torture.heavy import HEAVY
from tests.torture.knives import KNIVES
from tests.torture.rollers import ROLLERS
from tests.torture.slope import SLOPE
from tests.torture.slots import SLOTS
from tests.torture.spikes import SPIKES
from tests.torture.stack import STACK
from tests.torture.twist8 import TWIST8
from tests.torture.watch import Torture

TORTURE: dict[str, Torture] = {
    scene.full.name.removeprefix("torture-"): scene
    for scene in (STACK, ALIGNED, SLOTS, HEAVY, KNIVES, SPIKES, TWIST8, ROLLERS, FUNNEL, ARCH, SLOPE)
}
