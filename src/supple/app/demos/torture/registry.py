"""All torture scenes by name. A new one is one file and one line here."""

from __future__ import annotations

from supple.app.demos.torture.aligned import ALIGNED
from supple.app.demos.torture.arch import ARCH
from supple.app.demos.torture.funnel import FUNNEL
from supple.app.demos.torture.heavy import HEAVY
from supple.app.demos.torture.knives import KNIVES
from supple.app.demos.torture.rollers import ROLLERS
from supple.app.demos.torture.slope import SLOPE
from supple.app.demos.torture.slots import SLOTS
from supple.app.demos.torture.spikes import SPIKES
from supple.app.demos.torture.stack import STACK
from supple.app.demos.torture.twist8 import TWIST8
from supple.app.demos.torture.watch import Torture

TORTURE: dict[str, Torture] = {
    scene.full.name.removeprefix("torture-"): scene
    for scene in (STACK, ALIGNED, SLOTS, HEAVY, KNIVES, SPIKES, TWIST8, ROLLERS, FUNNEL, ARCH, SLOPE)
}
