"""Several materials in one body."""

import numpy as np
import pytest

import supple as sp
from supple.errors import SceneError
from supple.materials.elastic import EdgesAndVolume, NeoHookean, StableNeoHookean
from supple.materials.elastic_tets.regions import Regions
from supple.materials.kinds import needs_positive_volume
from supple.materials.per_tet import NOT_ELASTIC
from supple.model.system import build_system

SOFT = StableNeoHookean(youngs=1e4, poisson=0.3, density=900.0, damping=0.01)
HARD = NeoHookean(youngs=1e7, poisson=0.2, density=2000.0)


def test_each_tet_has_its_own_material():
    body = Regions(materials=[SOFT, HARD], index=[0, 1, 1, 0])
    tet = body.per_tet(4)
    np.testing.assert_array_equal(tet.density, [900.0, 2000.0, 2000.0, 900.0])
    np.testing.assert_array_equal(tet.damping, [0.01, 0.0, 0.0, 0.01])
    np.testing.assert_array_equal(
        tet.kind, [StableNeoHookean.energy_kind(), *[NeoHookean.energy_kind()] * 2, StableNeoHookean.energy_kind()]
    )
    assert (tet.mu[0], tet.lam[0]) == SOFT.lame_parameters()
    assert (tet.mu[1], tet.lam[1]) == HARD.lame_parameters()
    np.testing.assert_array_equal(needs_positive_volume(tet.kind), [False, True, True, False])
    F = np.eye(3) + 0.1 * np.random.default_rng(0).normal(size=(4, 3, 3))
    for k, material in enumerate((SOFT, HARD, HARD, SOFT)):
        assert body.energy_density(F)[k] == material.energy_density(F[k])
        np.testing.assert_array_equal(body.hessian(F)[k], material.hessian(F[k]))


def test_materials_of_regions_may_vary_per_tet():
    graded = StableNeoHookean(youngs=np.array([1e4, 2e4, 3e4]), poisson=0.3)
    body = Regions(materials=[graded, HARD], index=np.array([0, 1, 0]))
    np.testing.assert_array_equal(body.youngs, [1e4, 1e7, 3e4])
    assert body.per_tet(3).mu[2] == graded.lame_parameters()[0][2]


def test_a_single_material_per_tet():
    tet = SOFT.per_tet(3)
    assert tet.kind.tolist() == [0, 0, 0]
    assert tet.density.tolist() == [900.0] * 3
    assert EdgesAndVolume(density=500.0).per_tet(2).kind.tolist() == [NOT_ELASTIC] * 2
    with pytest.raises(SceneError, match="youngs has 2 values for 3 tets"):
        StableNeoHookean(youngs=[1e4, 1e5], poisson=0.3).per_tet(3)


@pytest.mark.parametrize(
    ("materials", "index", "text"),
    [
        ([], [0], "materials is empty"),
        ([SOFT, EdgesAndVolume()], [0], r"materials\[1\] is a EdgesAndVolume"),
        ([SOFT, HARD], [0, 2], "index of tet 1 is 2; there are materials 0 to 1"),
        ([SOFT, HARD], [0, -1], "index of tet 1 is -1"),
        ([SOFT, HARD], [0.5, 1.0], "whole number"),
        (
            [SOFT, StableNeoHookean(youngs=[1e4, 1e5], poisson=0.3)],
            [0, 1, 1],
            r"materials\[1\] has 2 values for 3 tets",
        ),
    ],
)
def test_errors(materials, index, text):
    with pytest.raises(SceneError, match=text):
        Regions(materials=materials, index=index)


def test_the_index_must_have_the_length_of_the_mesh():
    with pytest.raises(SceneError, match="index has 2 values for 5 tets"):
        Regions(materials=[SOFT], index=[0, 0]).per_tet(5)


def test_masses_of_a_body_of_two_materials():
    mesh = sp.shapes.box(size=(2.0, 1.0, 1.0), divisions=(4, 2, 2))
    centers = mesh.vertices[mesh.tets].mean(axis=1)
    index = (centers[:, 0] > centers[:, 0].mean()).astype(int)
    body = sp.Body("bar", mesh, Regions(materials=[SOFT, HARD], index=index))
    system = build_system(sp.Scene(bodies=[body]))
    volume = mesh.volumes.sum()
    assert system.masses.sum() == pytest.approx(0.5 * volume * (900.0 + 2000.0))
    with pytest.raises(SceneError, match="body 'bar': Regions: index has 3 values"):
        sp.Body("bar", mesh, Regions(materials=[SOFT], index=[0, 0, 0]))
