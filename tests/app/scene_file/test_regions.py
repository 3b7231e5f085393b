"""Bodies of several materials."""

import numpy as np
import pytest
from jsonschema import Draft202012Validator

import supple as sp
from supple.app.scene_file.document import json_schema
from supple.app.scene_file.yaml_files import read_yaml

REGIONS = """
bodies:
  - name: arm
    shape: {kind: box, size: [4, 1, 1], divisions: [4, 1, 1]}
    material: {kind: stable_neo_hookean, youngs: 1e4, poisson: 0.4, density: 1000}
    position: [100, 0, 0]
    copies: {offsets: [[0, 0, 0], [0, 5, 0]]}
    regions:
      - box: {low: [0, -9, -9], high: [2, 9, 9]}
        material: {kind: neo_hookean, youngs: 1e7, poisson: 0.3, density: 2000}
      - {tets: [0, 1], material: {kind: arap, youngs: 1e3, poisson: 0.4}}
"""


def test_regions_of_a_body_have_materials_of_their_own(load, tmp_path):
    scene = load(REGIONS).scene
    assert len(scene.bodies) == 2
    for body in scene.bodies:
        material, mesh = body.material, body.mesh
        assert isinstance(material, sp.Regions)
        assert [type(part) for part in material.materials] == [sp.StableNeoHookean, sp.NeoHookean, sp.ARAP]
        right = mesh.vertices[mesh.tets].mean(axis=1)[:, 0] > 0
        expected = np.where(right, 1e7, 1e4)
        expected[[0, 1]] = 1e3
        np.testing.assert_array_equal(material.youngs, expected)
    mass = (scene.bodies[0].material.density * scene.bodies[0].mesh.volumes).sum()
    assert mass == pytest.approx(2 * 1000 + 2 * 2000)
    data = read_yaml(tmp_path / "scene.yaml").data
    validator = Draft202012Validator(json_schema())
    assert list(validator.iter_errors(data)) == []
    data["bodies"][0]["regions"][0]["material"] = {"kind": "edges_and_volume"}
    assert not validator.is_valid(data)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("low: [0, -9, -9]", "low: [1.99, 8, 8]", r"scene.yaml:9: bodies\[0\].regions\[0\].box: no tet has its center"),
        ("low: [0, -9, -9]", "low: [3, -9, -9]", r"scene.yaml:9: bodies\[0\].regions\[0\].box.low: .*swap them"),
        (
            "tets: [0, 1]",
            "tets: [0, 24]",
            r":11: bodies\[0\].regions\[1\].tets: names tet 24; the mesh has tets 0 to 23",
        ),
        (
            "tets: [0, 1], ",
            "",
            r":11: bodies\[0\].regions\[1\]: give the tets of a region by either `box`, `tets` or `set`",
        ),
        ("tets: [0, 1]", "tet: [0, 1]", r"regions\[1\].tet: unknown key; did you mean 'tets'"),
        (
            "{kind: arap, youngs: 1e3, poisson: 0.4}",
            "{kind: edges_and_volume}",
            r"regions\[1\].material.kind: unknown kind",
        ),
        (
            "{kind: stable_neo_hookean, youngs: 1e4, poisson: 0.4, density: 1000}",
            "{kind: edges_and_volume}",
            r"bodies\[0\].regions: .*elastic material, which EdgesAndVolume is not",
        ),
    ],
)
def test_errors_in_regions_name_their_line(load, old, new, message):
    assert REGIONS.count(old) == 1
    with pytest.raises(sp.SceneError, match=message):
        load(REGIONS.replace(old, new))
