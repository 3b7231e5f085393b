"""All demos by name. A new demo is one file and one line here."""

from __future__ import annotations

from supple.app.demos.bag import BAG
from supple.app.demos.balloon import BALLOON
from supple.app.demos.bears import BEARS
from supple.app.demos.compliance import COMPLIANCE
from supple.app.demos.cuff import CUFF
from supple.app.demos.demo import Demo
from supple.app.demos.drape import DRAPE
from supple.app.demos.gripper import GRIPPER
from supple.app.demos.knot import KNOT
from supple.app.demos.pneunet import PNEUNET
from supple.app.demos.squash import SQUASH
from supple.app.demos.stitch import STITCH
from supple.app.demos.stretch import STRETCH
from supple.app.demos.twist import TWIST
from supple.errors import SceneError

_ALL = (SQUASH, STRETCH, COMPLIANCE, BEARS, STITCH, TWIST, PNEUNET, GRIPPER, DRAPE, BAG, BALLOON, CUFF, KNOT)
DEMOS: dict[str, Demo] = {demo.name: demo for demo in _ALL}


def find_demo(name: str) -> Demo:
    """The demo of that name.

    Raises
    ------
    SceneError : where none exists.
    """
    if name not in DEMOS:
        raise SceneError(f"demo {name!r} does not exist; there are {', '.join(DEMOS)}")
    return DEMOS[name]
