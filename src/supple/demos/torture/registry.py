"""All torture scenes by name. A new one is one file and one line here."""

from __future__ import annotations

from supple.demos.torture.aligned import ALIGNED
from supple.demos.torture.arch import ARCH
from supple.demos.torture.funnel import FUNNEL
from supple.demos.torture.heavy import HEAVY
from supple.demos.torture.knives import KNIVES
from supple.demos.torture.rollers import ROLLERS
from supple.demos.torture.slope import SLOPE
from supple.demos.torture.slots import SLOTS
from supple.demos.torture.spikes import SPIKES
from supple.demos.torture.stack import STACK
from supple.demos.torture.twist8 import TWIST8
from supple.demos.torture.watch import Torture

TORTURE: dict[str, Torture] = {
    scene.full.name.removeprefix("torture-"): scene
    for scene in (STACK, ALIGNED, SLOTS, HEAVY, KNIVES, SPIKES, TWIST8, ROLLERS, FUNNEL, ARCH, SLOPE)
}
