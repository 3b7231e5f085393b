"""How many tets a line through a body crosses."""

import numpy as np

import supple as sp
from supple.mesh.quality import thickness


def test_three_for_each_cell_of_a_box():
    for cells in (1, 2, 3):
        mesh = sp.shapes.box((4.0, 1.0, 0.05), (6, 5, cells))
        lines = thickness(mesh.vertices, mesh.tets, limit=20)
        normal_z = np.isclose(lines.areas, 4.0 * 1.0 / 30 / 2)
        np.testing.assert_array_equal(lines.crossed[normal_z], 3 * cells)
        assert lines.areas.sum() == np.float64(mesh.surface.area).round(12)


def test_unstructured_tets_count_by_their_volume():
    """A ball of 1 m: on average about three for each cube of six times the mean volume, and none beyond the limit."""
    mesh = sp.shapes.sphere(0.5, 0.12)
    lines = thickness(mesh.vertices, mesh.tets, limit=60)
    across = 1.0 / np.cbrt(6 * mesh.volumes.mean())
    assert 0.7 < lines.crossed.mean() / (3 * across) < 1.4
    assert thickness(mesh.vertices, mesh.tets, limit=9).crossed.max() == 9
