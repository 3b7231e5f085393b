"""`supple fit`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

if TYPE_CHECKING:
    from supple.materials.by_law import ByLaw

_UNITS = {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "psi": 6894.757293168361, "kg/cm2": 98066.5}


Parameters = Annotated[list[str] | None, Parameter(name=["--parameters", "-p"], consume_multiple=True, negative="")]
Data = Annotated[list[Path] | None, Parameter(consume_multiple=True, negative="")]


def fit(
    what: Path,
    /,
    *,
    parameters: Parameters = None,
    data: Data = None,
    of: str | None = None,
    evaluations: int = 50,
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
    """Fit values of a scene file to measurements, or the parameters of rubber to its tests.

    Prints the values with their standard errors, and of rubber with 95 % confidence, and a line of a scene file.

    Parameters
    ----------
    what
        A scene file (.yaml); or the energy of rubber: mooney_rivlin, yeoh or ogden.
    parameters
        Of a scene file: PATH=LOW:HIGH or PATH=LOW:START:HIGH, such as bodies.bear.material.youngs=1e4:1e6.
    data
        Of a scene file: CSV files with the columns time, vertex or marker, x, y and z; or displacement and force.
    of
        The body of the markers, or the pin or obstacle that has the force; without it, the only one.
    evaluations
        Of a scene file: the most runs.
    uniaxial
        Of rubber: CSV file with columns stretch, strain or extension, and nominal stress or load; may be given several
        times.
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
        Of a scene file: folder for fitted.yaml, fit.png and the runs, from which the same command goes on; by default
        "fit". Of rubber: picture of the tests and the fit (.png, .pdf or .svg).
    """
    from supple.errors import SceneError
    from supple.kinds.suggestion import suggestion
    from supple.materials.rubber import MooneyRivlin, Ogden, Yeoh
    from supple.runtime.replacing import refuse_to_replace

    energies = {one.kind: one for one in (MooneyRivlin, Yeoh, Ogden)}
    of_rubber = {"uniaxial": uniaxial, "equibiaxial": equibiaxial, "pure-shear": pure_shear, "unit": unit}
    of_rubber |= {"area": area, "length": length, "bulk": bulk}
    of_scenes = {"parameters": parameters, "data": data, "of": of}
    for name, given in (of_scenes if str(what) in energies else of_rubber).items():
        if given is not None:
            kind = "a scene file" if str(what) in energies else "rubber"
            raise SceneError(f"--{name} is for a fit of {kind}; {what} is not one")
    if str(what) not in energies:
        if not what.suffix:
            raise SceneError(f"{what}: {suggestion(str(what), list(energies))}; or give a scene file")
        _fit_scene(what, parameters or [], data or [], of, evaluations, output or Path("fit"))
        return
    from supple.materials.fit import fit_material

    if output is not None:
        for path in (*(uniaxial or ()), *(equibiaxial or ()), *(pure_shear or ())):
            refuse_to_replace(path, output)
    found = fit_material(
        energies[str(what)],
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


def check_gradient(scene: Path, /, *, parameters: Parameters = None, data: Data = None, of: str | None = None) -> int:
    """Compare the gradient that `supple fit` uses with differences of whole runs, along random directions.

    Says which is at fault where they do not agree; the exit code is then 1.

    Parameters
    ----------
    scene
        A scene file (.yaml).
    parameters
        PATH=LOW:HIGH or PATH=LOW:START:HIGH, such as bodies.bear.material.youngs=1e4:1e6.
    data
        CSV files with the columns time, vertex or marker, x, y and z; or displacement and force.
    of
        The body of the markers, or the pin or obstacle that has the force; without it, the only one.
    """
    from supple.app.cli.console import ExitCode
    from supple.app.studies.scene_fit import SceneFit

    one = SceneFit.of(scene, parameters or [], data or [], of)
    found = one.sensitivity.check(one.start)
    print(found)
    return ExitCode.OK if found.ok else ExitCode.FAILED


def _fit_scene(
    scene: Path, parameters: list[str], data: list[Path], of: str | None, evaluations: int, output: Path
) -> None:
    from supple.app.studies.scene_fit import SceneFit

    def report(line: str) -> None:
        print(line, flush=True)

    found, files = SceneFit.of(scene, parameters, data, of).run(output, evaluations, report)
    print(found)
    print(*files, sep="\n")


def _scene_file_line(material: ByLaw) -> str:
    """A rubber as a scene file has it, with the parameters of its class; density and damping are left out."""
    from dataclasses import fields

    from supple.kinds.kind import declared
    from supple.materials.material import Material

    skipped = {field.name for field in fields(Material)}
    values = {key: getattr(material, key) for key in declared(type(material)) if key not in skipped}
    texts = [f"{key}: {list(value) if isinstance(value, tuple) else float(value)}" for key, value in values.items()]
    return f"{{kind: {material.kind}, {', '.join(texts)}}}"
