"""`supple fit`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

if TYPE_CHECKING:
    from supple.materials.by_law import ByLaw

_UNITS = {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "psi": 6894.757293168361, "kg/cm2": 98066.5}


def fit(
    kind: Literal["mooney_rivlin", "yeoh", "ogden"],
    /,
    *,
    uniaxial: list[Path] | None = None,
    equibiaxial: list[Path] | None = None,
    pure_shear: list[Path] | None = None,
    unit: Literal["Pa", "kPa", "MPa", "psi", "kg/cm2"] | None = None,
    area: float | None = None,
    length: float | None = None,
    terms: int = 2,
    bulk: float | None = None,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
) -> None:
    """Fit the parameters of rubber to its tests; prints them with 95 % confidence, and as a line of a scene file.

    Parameters
    ----------
    kind
        Which energy.
    uniaxial
        CSV file with columns stretch, strain or extension, and nominal stress or load; may be given several times.
    equibiaxial
        Likewise, of equibiaxial tension.
    pure_shear
        Likewise, of pure shear.
    unit
        Of the stresses; without it, the unit that the column names, or Pa.
    area
        Of the specimen's section at rest [m^2], for the load of a testing machine.
    length
        Of the specimen at rest [m], for the extension of a testing machine.
    terms
        Of Ogden's energy, 1 to 3.
    bulk
        Bulk modulus of the result [Pa]; without it, 500 times the shear modulus.
    output
        Picture of the tests and the fit (.png, .pdf or .svg).
    """
    from supple.materials.fit import fit_material
    from supple.materials.rubber import MooneyRivlin, Ogden, Yeoh
    from supple.runtime.replacing import refuse_to_replace

    if output is not None:
        for path in (*(uniaxial or ()), *(equibiaxial or ()), *(pure_shear or ())):
            refuse_to_replace(path, output)
    found = fit_material(
        {one.kind: one for one in (MooneyRivlin, Yeoh, Ogden)}[kind],
        uniaxial,
        equibiaxial=equibiaxial,
        pure_shear=pure_shear,
        terms=terms,
        bulk=bulk,
        stress_unit=None if unit is None else _UNITS[unit],
        area=area,
        length=length,
    )
    print(found)
    print(f"material: {_scene_file_line(found.material)}")
    if output is not None:
        print(found.plot(output))


def _scene_file_line(material: ByLaw) -> str:
    """A rubber as a scene file has it, with the parameters of its class; density and damping are left out."""
    from dataclasses import fields

    from supple.kinds.kind import declared
    from supple.materials.material import Material

    skipped = {field.name for field in fields(Material)}
    values = {key: getattr(material, key) for key in declared(type(material)) if key not in skipped}
    texts = [f"{key}: {list(value) if isinstance(value, tuple) else float(value)}" for key, value in values.items()]
    return f"{{kind: {material.kind}, {', '.join(texts)}}}"
