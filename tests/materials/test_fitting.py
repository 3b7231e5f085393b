"""Parameters from tests: exact ones come back, intervals have their coverage, and Treloar's rubber is described."""

from pathlib import Path

import numpy as np
import pytest

import supple as sp
from supple.app.cli.app import main
from supple.errors import OutputError, SceneError

RUBBER = Path(__file__).parents[2] / "examples" / "rubber"
TRELOAR = {mode: RUBBER / f"treloar_{mode}.csv" for mode in ("uniaxial", "equibiaxial")}
STRETCH = np.linspace(0.7, 3.0, 24)


def mooney_stress(c10, c01, stretch, mode):
    """Treloar, "The Physics of Rubber Elasticity", chapter 5."""
    if mode == "uniaxial":
        return 2 * (stretch - stretch**-2) * (c10 + c01 / stretch)
    if mode == "equibiaxial":
        return 2 * (stretch - stretch**-5) * (c10 + c01 * stretch**2)
    return 2 * (stretch - stretch**-3) * (c10 + c01)


def test_exact_data_give_back_the_parameters():
    tests = {
        mode: np.column_stack([STRETCH, mooney_stress(2e5, 3e4, STRETCH, mode)])
        for mode in ("uniaxial", "equibiaxial", "pure_shear")
    }
    fit = sp.fit_material(sp.MooneyRivlin, **tests)
    np.testing.assert_allclose(fit.values, [2e5, 3e4], rtol=1e-9)
    assert (fit.material.c10, fit.material.c01) == tuple(fit.values)
    assert fit.material.poisson == pytest.approx(0.499, abs=2e-4)
    assert max(fit.residuals.values()) < 1e-10
    stress = 6.3e5 * (STRETCH**0.3 - STRETCH**-1.65) - 1e4 * (STRETCH**-3.0 - STRETCH**0.0)
    curve = np.column_stack([STRETCH, stress])
    found = sp.fit_material(sp.Ogden, curve, terms=2, bulk=1e9)
    order = np.argsort(found.material.mu)
    np.testing.assert_allclose(np.asarray(found.material.mu)[order], [-1e4, 6.3e5], rtol=1e-4)
    np.testing.assert_allclose(np.asarray(found.material.alpha)[order], [-2.0, 1.3], rtol=1e-4)
    yeoh = sp.fit_material(sp.Yeoh, [tests["uniaxial"], tests["uniaxial"]])
    assert yeoh.names == ("c10", "c20", "c30")
    assert len(yeoh.curves) == 2


def test_confidence_intervals_contain_the_truth_as_often_as_they_say():
    rng = np.random.default_rng(5)
    exact = mooney_stress(2e5, 3e4, STRETCH, "uniaxial")
    inside = np.zeros(2)
    for _ in range(80):
        noisy = exact + rng.normal(0, 5e3, len(exact))
        fit = sp.fit_material(sp.MooneyRivlin, np.column_stack([STRETCH, noisy]), confidence=0.9)
        inside += (fit.intervals[:, 0] < [2e5, 3e4]) & (fit.intervals[:, 1] > [2e5, 3e4])
    # Three standard deviations of a binomial distribution.
    np.testing.assert_allclose(inside / 80, 0.9, atol=3 * np.sqrt(0.09 / 80))


def test_treloars_rubber(tmp_path, capsys):
    fit = sp.fit_material(sp.Ogden, **TRELOAR, terms=3, stress_unit=98066.5)
    assert max(fit.residuals.values()) < 0.02
    assert (np.diff(fit.intervals, axis=1) > 0).all()
    assert fit.plot(tmp_path / "fit.png").read_bytes()[1:4] == b"PNG"
    # The parameters that Ogden gave in 1972 describe the same data.
    ogden = sp.Ogden(mu=[0.63e6, 0.0012e6, -0.01e6], alpha=[1.3, 5.0, -2.0], bulk=1e9)
    for curve in fit.curves:
        F = curve.stretch[:, None] ** (np.array([1, -0.5, -0.5]) if curve.mode == "uniaxial" else np.array([1, 1, -2]))
        P = ogden.first_piola(F[:, :, None] * np.eye(3))
        stress = P[:, 0, 0] - P[:, 2, 2] * F[:, 2] / F[:, 0]
        middle = (curve.stretch > 1.05) & (curve.stretch < 7.0)
        np.testing.assert_allclose(stress[middle], curve.stress[middle], rtol=0.14)
        fitted = fit.stresses(curve.stretch, curve.mode)
        np.testing.assert_allclose(fitted, curve.stress, rtol=0, atol=0.05 * curve.stress.max())
    with pytest.raises(OutputError, match=r"picture format .* does not exist"):
        fit.plot(tmp_path / "fit.bmp")
    given = [f"--{mode}={path}" for mode, path in TRELOAR.items()]
    assert main(["fit", "yeoh", *given, "--unit", "kg/cm2", "-o", str(tmp_path / "yeoh.svg")]) == 0
    printed = capsys.readouterr().out
    assert (tmp_path / "yeoh.svg").exists()
    scene = tmp_path / "scene.yaml"
    line = next(line for line in printed.splitlines() if line.startswith("material:"))
    scene.write_text(f"bodies:\n  - name: b\n    shape: {{kind: box}}\n    {line}\nsolver: {{kind: implicit}}\n")
    assert sp.load_scene(scene).bodies[0].material.c10 == pytest.approx(1.98e5, rel=0.01)


def test_wrong_tests_are_one_clear_line(tmp_path):
    path = tmp_path / "test.csv"
    for text, message in (
        (
            "force,length\n1,2\n",
            "test.csv: has the columns force, length; name two of them stretch and stress, or extension and load",
        ),
        ("stretch,stress\n1.1,abc\n", "test.csv:2: has no number in the column stress"),
        ("stretch,stress\n-1.1,2\n", "test.csv: row 1 of the data is not a stretch above 0"),
        ("strain,stress\n0.1,1e5\n0.2,2e5\n", "2 data with a stretch other than 1 for 2 parameters"),
    ):
        path.write_text(text)
        with pytest.raises(SceneError, match=message):
            sp.fit_material(sp.MooneyRivlin, path)
    with pytest.raises(SceneError, match=r"missing.csv: cannot be read: No such file"):
        sp.fit_material(sp.MooneyRivlin, "missing.csv")
    with pytest.raises(SceneError, match="NeoHookean cannot be fitted; give MooneyRivlin, Yeoh or Ogden"):
        sp.fit_material(sp.NeoHookean, TRELOAR["uniaxial"])
    with pytest.raises(SceneError, match="terms is 4; give 1, 2 or 3"):
        sp.fit_material(sp.Ogden, TRELOAR["uniaxial"], terms=4)
    falling = np.column_stack([STRETCH, -mooney_stress(2e5, 3e4, STRETCH, "uniaxial")])
    with pytest.raises(SceneError, match="has the shear modulus -460000 Pa at rest"):
        sp.fit_material(sp.MooneyRivlin, falling)


MACHINES = {
    "english": "Specimen,A7\nRate (mm/min),50\n\nTime (s),Extension (mm),Load (N)\n{rows}",
    "a line of units": 'Time,Extension,Load\n"(s)","(mm)","(N)"\n{rows}',
    "semicolons and decimal commas": "Probe;7\nZeit;Travel [mm];Standard force [N]\n{rows}",
    "kilonewtons": "time [s]\tdisplacement [mm]\tforce [kN]\n{rows}",
    "strain in per cent and MPa": "Time (s),Tensile strain (%),Tensile stress (MPa)\n{rows}",
}


@pytest.mark.parametrize("kind", MACHINES)
def test_files_of_machines_are_read_as_they_are(tmp_path, capsys, kind):
    area, length = 12e-6, 0.025
    stress = mooney_stress(2e5, 3e4, STRETCH, "uniaxial")
    travel, load = (STRETCH - 1.0) * length * 1e3, stress * area
    if kind == "kilonewtons":
        load = load * 1e-3
    if kind.startswith("strain"):
        travel, load = 100.0 * (STRETCH - 1.0), stress * 1e-6
    separator = {"semi": ";", "kilo": "\t"}.get(kind[:4], ",")
    lines = [separator.join(f"{x:.12g}" for x in row) for row in zip(range(24), travel, load, strict=True)]
    text = MACHINES[kind].format(rows="\n".join(lines))
    path = tmp_path / "test.csv"
    path.write_text(text.replace(".", ",") if separator == ";" else text, encoding="latin-1")
    fit = sp.fit_material(sp.MooneyRivlin, path, area=area, length=length)
    np.testing.assert_allclose(fit.values, [2e5, 3e4], rtol=1e-8)
    assert main(["fit", "mooney_rivlin", "--uniaxial", str(path), "--area", "12e-6", "--length", "0.025"]) == 0
    assert "material:" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("text", "words", "options"),
    [
        ("Extension (mm),Load (N)\n1,2\n", "travel of a machine; give the length of the specimen", {"area": 1e-6}),
        ("Extension (mm),Load (N)\n1,2\n", "load of a machine; give the area of the specimen", {"length": 1.0}),
        ("Extension,Load (N)\n1,2\n", "the column travel has no unit; give one of m, cm, mm", {}),
        ("stretch,stress [bar]\n1,2\n", "the column stress has the unit 'bar'; give one of pa, kpa", {}),
        ("stretch,stress\n1,2\n", "area is -1; give a finite number above zero", {"area": -1.0}),
    ],
)
def test_what_a_machine_s_file_lacks_is_said(tmp_path, text, words, options):
    path = tmp_path / "test.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(SceneError, match=words):
        sp.fit_material(sp.MooneyRivlin, path, **options)


def test_the_unit_that_a_column_names_is_used_unless_another_one_is_given():
    own = sp.fit_material(sp.Yeoh, TRELOAR["uniaxial"])
    given = sp.fit_material(sp.Yeoh, TRELOAR["uniaxial"], stress_unit=98066.5)
    np.testing.assert_array_equal(own.values, given.values)
