"""All materials that a scene file can name. A new kind is one file and one line here, or `MATERIALS.append`."""

from __future__ import annotations

from supple.materials.elastic import EdgesAndVolume
from supple.materials.j2_plastic import J2Plastic
from supple.materials.material import Material
from supple.materials.viscoelastic import UNRELAXED, Viscoelastic

MATERIALS: list[type[Material]] = [EdgesAndVolume, *UNRELAXED, J2Plastic, Viscoelastic]
