"""`order: 2` of a body in a scene file."""

import pytest

import supple as sp

SCENE = """
bodies:
  - name: ball
    shape: {{kind: sphere, radius: 0.1, edge_length: 0.08}}
    material: {{kind: stable_neo_hookean, youngs: 1e4, poisson: 0.45}}
    order: {order}
  - name: block
    mesh: {{file: block.inp}}
    material: {{kind: neo_hookean, youngs: 1e4, poisson: 0.3}}
    position: [1, 0, 0]
    {block}
solver: {{kind: implicit}}
"""


@pytest.mark.parametrize(
    ("order", "block", "orders"), [(2, "", (2, 2)), (1, "order: 1", (1, 1)), (2, "order: 2", (2, 2))]
)
def test_orders_of_shapes_and_files(tmp_path, order, block, orders):
    sp.shapes.box((0.1, 0.1, 0.1), (1, 1, 1), order=2).save(tmp_path / "block.inp")
    (tmp_path / "scene.yaml").write_text(SCENE.format(order=order, block=block))
    ball, cube = sp.load_scene(tmp_path / "scene.yaml").bodies
    assert (ball.mesh.order, cube.mesh.order) == orders
    if order == 2:
        assert ball.mesh.volume == pytest.approx(sp.shapes.sphere(0.1, 0.08, order=2).volume)


def test_another_order_and_that_of_a_rigid_body_are_refused(tmp_path):
    sp.shapes.box((0.1, 0.1, 0.1), (1, 1, 1)).save(tmp_path / "block.inp")
    (tmp_path / "scene.yaml").write_text(SCENE.format(order=3, block=""))
    with pytest.raises(sp.SceneError, match="order"):
        sp.load_scene(tmp_path / "scene.yaml")
    text = "bodies: [{name: a, shape: {kind: box}, rigid: {mass: 1}, order: 2}]\nsolver: {kind: implicit}\n"
    (tmp_path / "scene.yaml").write_text(text)
    with pytest.raises(sp.SceneError, match="a rigid body has no `order`"):
        sp.load_scene(tmp_path / "scene.yaml")
