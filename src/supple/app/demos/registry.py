"""All demos by name. A new demo is one file and one line here."""

from __future__ import annotations

from supple.app.demos.actuators.balloon import BALLOON
from supple.app.demos.actuators.foam_press import FOAM_PRESS
from supple.app.demos.actuators.muscle import MUSCLE
from supple.app.demos.actuators.pneunet import PNEUNET
from supple.app.demos.actuators.tendon_finger import TENDON_FINGER
from supple.app.demos.bears import BEARS
from supple.app.demos.cantilever import CANTILEVER
from supple.app.demos.compliance import COMPLIANCE
from supple.app.demos.demo import Demo
from supple.app.demos.quilt import QUILT
from supple.app.demos.rigid.dominoes import DOMINOES
from supple.app.demos.rigid.dzhanibekov import DZHANIBEKOV
from supple.app.demos.rigid.gripper import GRIPPER
from supple.app.demos.rigid.ragdoll import RAGDOLL
from supple.app.demos.squash import SQUASH
from supple.app.demos.stitch import STITCH
from supple.app.demos.stretch import STRETCH
from supple.app.demos.twist import TWIST
from supple.errors import SceneError

_SOFT = (SQUASH, STRETCH, COMPLIANCE, BEARS, CANTILEVER, TWIST, STITCH, QUILT)
_DRIVEN = (BALLOON, MUSCLE, PNEUNET, TENDON_FINGER, FOAM_PRESS)
_RIGID = (DZHANIBEKOV, DOMINOES, GRIPPER, RAGDOLL)
DEMOS: dict[str, Demo] = {demo.name: demo for demo in (*_SOFT, *_DRIVEN, *_RIGID)}


def find_demo(name: str) -> Demo:
    """The demo of that name.

    Raises
    ------
    SceneError : where there is none.
    """
    if name not in DEMOS:
        raise SceneError(f"demo {name!r} does not exist; there are {', '.join(DEMOS)}")
    return DEMOS[name]
