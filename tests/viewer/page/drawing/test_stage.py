"""All ways to draw a moment: the sent messages, and that their number does not grow."""

from dataclasses import replace

import numpy as np
import pytest

from supple.viewer.drawing.coloring.fields import FIELDS
from supple.viewer.drawing.layers.springs import length_text
from supple.viewer.drawing.layers.tets import Cut, exploded_facets, kept_tets, outer_facets
from supple.viewer.drawing.moments.from_snapshot import MomentBuilder
from supple.viewer.drawing.options import COLOR_BY_BODY, SURFACES, ViewOptions
from supple.viewer.drawing.stage import Stage


def kept_messages(server):
    return len(server._websock_server.get_message_buffer().message_from_id)


@pytest.mark.parametrize("surface", SURFACES)
@pytest.mark.parametrize("color_by", [COLOR_BY_BODY, *FIELDS])
def test_bodies_are_drawn_at_their_positions(server, fake, surface, color_by):
    translator = MomentBuilder()
    stage = Stage(server, translator.moment(fake.snapshot), ViewOptions(surface, color_by, explode=0.1))
    shift = np.array([0.0, 5.0, 0.0])
    snapshot = fake.show(positions=fake.snapshot.positions + shift)
    stage.show(translator.moment(snapshot))
    drawn = np.concatenate([handle.vertices for handle in stage.body_handles if handle.visible])
    low, high = snapshot.positions.min(axis=0), snapshot.positions.max(axis=0)
    slack = 0.06 if surface == "exploded tets" else 1e-6
    if surface != "cut":
        assert np.all(np.abs(drawn.min(axis=0) - low) <= slack)
        assert np.all(np.abs(drawn.max(axis=0) - high) <= slack)
    else:
        assert drawn[:, 0].max() < high[0]


def test_the_number_of_buffered_messages_does_not_grow_with_moments(server, fake):
    translator = MomentBuilder()
    options = ViewOptions("tets", "volume ratio J", velocities=True, contacts=True)
    stage = Stage(server, translator.moment(fake.snapshot), options)
    rng = np.random.default_rng(5)
    counts = []
    for _ in range(30):
        x = fake.snapshot.positions + rng.normal(scale=0.05, size=fake.snapshot.positions.shape)
        stage.show(translator.moment(fake.show(positions=x, velocities=rng.normal(size=x.shape))))
        counts.append(kept_messages(server))
    assert counts[-1] <= counts[9] + 40  # only the visibility of colors that were not used before


def test_changed_options_remove_all_old_layers(server, fake):
    stage = Stage(server, MomentBuilder().moment(fake.snapshot), ViewOptions())
    for surface in (*SURFACES, "skin"):
        stage.apply(ViewOptions(surface, velocities=True, contacts=True))
    stage.apply(ViewOptions())
    names = set(server.scene._handle_from_node_name)
    drawn = {name for name in names if name.startswith(("/bodies/", "/velocities", "/contacts"))}
    # Empty groups stay: viser creates them.
    assert drawn - {"/bodies/tets", "/contacts"} == {"/bodies/0 body 0", "/bodies/1 body 1"}


def test_values_that_are_not_finite_are_not_sent(server, fake):
    x = fake.snapshot.positions.copy()
    x[3], x[4] = np.nan, np.inf
    translator = MomentBuilder()
    for options in (ViewOptions(), ViewOptions("exploded tets", "volume ratio J", velocities=True)):
        stage = Stage(server, translator.moment(fake.show(positions=x, velocities=x)), options)
        for handle in stage.body_handles:
            assert np.isfinite(handle.vertices).all()


def test_a_new_generation_creates_new_layers(server, fake):
    translator = MomentBuilder()
    stage = Stage(server, translator.moment(fake.snapshot), ViewOptions())
    old = fake.snapshot.description
    new = replace(old, generation=2, bodies=old.bodies[:1], n_vertices=27, n_tets=48)
    heard = []
    stage._prepare = heard.append
    stage.show(translator.moment(fake.show(description=new, positions=fake.snapshot.positions[:27])))
    assert [handle.name for handle in stage.body_handles] == ["/bodies/0 body 0"]
    assert heard == [stage.body_handles]


def test_springs_with_length_and_pins(server, fake):
    from supple.viewer.protocol.snapshots import GrabState

    translator = MomentBuilder()
    stage = Stage(server, translator.moment(fake.snapshot), ViewOptions())
    held = GrabState(7, "body 0", (0.0, 0.0, 0.0), (0.0, 0.3, 0.4))
    stage.show(translator.moment(fake.show(grabs=(held,), pinned=np.array([2]), pusher=((1.0, 2.0, 3.0), 0.2))))
    nodes = server.scene._handle_from_node_name
    assert nodes["/springs/7"].text == "50.0 cm"
    np.testing.assert_allclose(nodes["/springs/lines"].points, [[[0.0, 0.0, 0.0], [0.0, 0.3, 0.4]]], atol=1e-7)
    assert nodes["/springs/lines"].visible
    np.testing.assert_allclose(nodes["/pins"].points, fake.snapshot.positions[[2]])
    np.testing.assert_allclose(nodes["/pusher"].position, [1.0, 2.0, 3.0])
    assert nodes["/pusher"].visible
    stage.show(translator.moment(fake.show(grabs=(), pusher=None, pinned=np.zeros(0, int))))
    assert "/springs/7" not in nodes
    assert [nodes[name].visible for name in ("/springs/lines", "/pusher", "/pins")] == [False] * 3


def test_stitches_are_lines_between_vertices_and_triangles(server, fake):
    description = replace(fake.snapshot.description, stitches=np.array([[0, 30, 31, 33]], dtype=np.int32))
    stage = Stage(server, MomentBuilder().moment(fake.show(description=description)), ViewOptions())
    assert stage.options.stitches
    x = fake.snapshot.positions
    points = server.scene._handle_from_node_name["/stitches"].points
    np.testing.assert_allclose(points, [[x[0], x[[30, 31, 33]].mean(axis=0)]], atol=1e-6)


@pytest.mark.parametrize(("meters", "text"), [(1.234, "1.23 m"), (0.123, "12.3 cm"), (0.00123, "1.2 mm")])
def test_units_of_lengths(meters, text):
    assert length_text(meters) == text


def test_a_cut_draws_a_closed_surface_of_the_kept_tets(fake):
    model = MomentBuilder().moment(fake.snapshot).model
    kept = kept_tets(model, Cut(1, 0.5))
    assert 0 < kept.sum() < len(kept)
    triangles, owner = outer_facets(model, kept)
    assert kept[owner].all()
    # Closed: every edge occurs once in each direction; the volume is that of the tets inside.
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    forward, backward = ({tuple(edge) for edge in way} for way in (edges, edges[:, ::-1]))
    assert forward == backward
    a, b, c = (model.rest_positions[triangles[:, k]] for k in range(3))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0
    corners = model.rest_positions[model.tets[kept]]
    assert volume == pytest.approx(np.linalg.det(corners[:, 1:] - corners[:, :1]).sum() / 6.0)
    assert len(exploded_facets(model, kept)[0]) == 4 * kept.sum()
