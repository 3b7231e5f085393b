"""Messages about meshing use the words of Python, of scene files or of the shell."""

import pytest

from supple.errors import MeshingError
from supple.mesh.meshing.option_names import named_for, option
from supple.mesh.meshing.tetrahedralize import tetrahedralize
from supple.mesh.primitives.surfaces import sphere_surface
from supple.mesh.surface import SurfaceMesh


@pytest.mark.parametrize(
    ("writer", "expected"),
    [
        ("python", ["repair=True", "tets=500", 'mesher="stuffing"', "max_volume=0.0001", "time_limit"]),
        ("yaml", ["repair: true", "tets: 500", "mesher: stuffing", "max_volume: 0.0001", "time_limit"]),
        ("shell", ["--repair", "--tets 500", "--mesher stuffing", "--max-volume 0.0001", "--time-limit"]),
    ],
)
def test_options(writer, expected):
    with named_for(writer):
        given = {"repair": True, "tets": 500, "mesher": "stuffing", "max_volume": 1e-4, "time_limit": None}
        assert [option(name, value) for name, value in given.items()] == expected
    assert option("repair", True) == "repair=True"


@pytest.mark.parametrize(("writer", "words"), [("yaml", "repair: true"), ("shell", "--repair"), ("python", "repair=T")])
def test_an_open_surface_is_an_error_in_the_words_of_the_user(writer, words):
    ball = sphere_surface(radius=0.5, edge_length=0.2)
    with named_for(writer), pytest.raises(MeshingError, match=words):
        tetrahedralize(SurfaceMesh(ball.vertices, ball.triangles[3:]), mesher="tetgen")
