"""Materials of a scene file, by `kind`."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING

from supple.app.scene_file.entries import spelling as spelling  # registers how values are written
from supple.app.scene_file.entries.kinds import KindModel, entry_of
from supple.kinds.kind import declared
from supple.materials.edges_and_volume import EdgesAndVolume
from supple.materials.hyperelastic.by_law import ByLaw
from supple.materials.j2_plastic import J2Plastic
from supple.materials.material import Material
from supple.materials.registry import UNRELAXED
from supple.materials.viscoelastic import Viscoelastic

ELASTIC: tuple[type[Material], ...] = (*UNRELAXED, J2Plastic, Viscoelastic)
MATERIALS: tuple[type[Material], ...] = (EdgesAndVolume, *ELASTIC)
BY_LAW_KINDS: dict[str, type[ByLaw]] = {kind.kind: kind for kind in UNRELAXED if issubclass(kind, ByLaw)}

if TYPE_CHECKING:
    ElasticMaterialModel = MaterialModel = KindModel
else:
    ElasticMaterialModel, MaterialModel = entry_of(ELASTIC), entry_of(MATERIALS)


def scene_file_line(material: ByLaw) -> str:
    """A rubber as a scene file has it, with the parameters of its class; density and damping are left out."""
    skipped = {field.name for field in fields(Material)} | {"integration"}
    values = {key: getattr(material, key) for key in declared(type(material)) if key not in skipped}
    texts = [f"{key}: {list(value) if isinstance(value, tuple) else float(value)}" for key, value in values.items()]
    return f"{{kind: {material.kind}, {', '.join(texts)}}}"
