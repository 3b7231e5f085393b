"""All ways to draw a frame: the sent messages, and that their number does not grow."""

from dataclasses import replace

import numpy as np
import pytest

import supple as sp
from supple.app.viewer.from_snapshot import RenderFrameBuilder
from supple.results.view.fields import FIELDS
from supple.results.view.layers.connections import length_text
from supple.results.view.layers.section import Cut, surface
from supple.results.view.layers.tets import exploded_facets
from supple.results.view.options import COLOR_BY_BODY, SURFACES, ViewOptions
from supple.results.view.stage import Stage


def kept_messages(server):
    return len(server._websock_server.get_message_buffer().message_from_id)


@pytest.mark.parametrize("surface", SURFACES)
@pytest.mark.parametrize("color_by", [COLOR_BY_BODY, *FIELDS])
def test_bodies_are_drawn_at_their_positions(server, fake, surface, color_by):
    translator = RenderFrameBuilder()
    stage = Stage(server, translator.frame(fake.snapshot), ViewOptions(surface, color_by, explode=0.1))
    shift = np.array([0.0, 5.0, 0.0])
    snapshot = fake.show(positions=fake.snapshot.positions + shift)
    stage.show(translator.frame(snapshot))
    drawn = np.concatenate([handle.vertices for handle in stage.body_handles if handle.visible])
    low, high = snapshot.positions.min(axis=0), snapshot.positions.max(axis=0)
    slack = 0.06 if surface == "exploded tets" else 1e-6
    if surface != "cut":
        assert np.all(np.abs(drawn.min(axis=0) - low) <= slack)
        assert np.all(np.abs(drawn.max(axis=0) - high) <= slack)
    else:
        assert drawn[:, 0].max() < high[0]


def test_the_number_of_buffered_messages_does_not_grow_with_frames(server, fake):
    translator = RenderFrameBuilder()
    options = ViewOptions("tets", "volume ratio J", velocities=True, contacts=True)
    stage = Stage(server, translator.frame(fake.snapshot), options)
    rng = np.random.default_rng(5)
    counts = []
    for _ in range(30):
        x = fake.snapshot.positions + rng.normal(scale=0.05, size=fake.snapshot.positions.shape)
        stage.show(translator.frame(fake.show(positions=x, velocities=rng.normal(size=x.shape))))
        counts.append(kept_messages(server))
    assert counts[-1] <= counts[9] + 40  # only the visibility of colors that were not used before


def test_changed_options_remove_all_old_layers(server, fake):
    stage = Stage(server, RenderFrameBuilder().frame(fake.snapshot), ViewOptions())
    for kind in (*SURFACES, "skin"):
        stage.apply(ViewOptions(kind, velocities=True, contacts=True))
    stage.apply(ViewOptions())
    names = set(server.scene._handle_from_node_name)
    drawn = {name for name in names if name.startswith(("/bodies/", "/velocities", "/contacts"))}
    # Empty groups stay: viser creates them.
    assert drawn - {"/bodies/tets", "/contacts"} == {"/bodies/0 body 0", "/bodies/1 body 1"}


def test_values_that_are_not_finite_are_not_sent(server, fake):
    x = fake.snapshot.positions.copy()
    x[3], x[4] = np.nan, np.inf
    translator = RenderFrameBuilder()
    for options in (ViewOptions(), ViewOptions("exploded tets", "volume ratio J", velocities=True)):
        stage = Stage(server, translator.frame(fake.show(positions=x, velocities=x)), options)
        for handle in stage.body_handles:
            assert np.isfinite(handle.vertices).all()


def test_a_new_generation_creates_new_layers(server, fake):
    translator = RenderFrameBuilder()
    stage = Stage(server, translator.frame(fake.snapshot), ViewOptions())
    old = fake.snapshot.description
    new = replace(old, generation=2, bodies=old.bodies[:1], n_vertices=27, n_tets=48)
    heard = []
    stage.prepare_bodies(heard.append)
    heard.clear()
    stage.show(translator.frame(fake.show(description=new, positions=fake.snapshot.positions[:27])))
    assert [handle.name for handle in stage.body_handles] == ["/bodies/0 body 0"]
    assert heard == [stage.body_handles]


def test_springs_with_length_and_pins(server, fake):
    from supple.app.viewer.protocol.snapshots import GrabState

    translator = RenderFrameBuilder()
    stage = Stage(server, translator.frame(fake.snapshot), ViewOptions())
    held = GrabState(7, "body 0", (0.0, 0.0, 0.0), (0.0, 0.3, 0.4))
    stage.show(translator.frame(fake.show(grabs=(held,), pinned=np.array([2]))))
    nodes = server.scene._handle_from_node_name
    assert nodes["/springs/7"].text == "50.0 cm"
    np.testing.assert_allclose(nodes["/springs/lines"].points, [[[0.0, 0.0, 0.0], [0.0, 0.3, 0.4]]], atol=1e-7)
    assert nodes["/springs/lines"].visible
    np.testing.assert_allclose(nodes["/pins"].points, fake.snapshot.positions[[2]])
    stage.show(translator.frame(fake.show(grabs=(), pinned=np.zeros(0, int))))
    assert "/springs/7" not in nodes
    assert [nodes[name].visible for name in ("/springs/lines", "/pins")] == [False] * 2


def test_stitches_are_lines_from_vertices_to_the_places_that_were_nearest(server, fake):
    drawn = replace(
        fake.snapshot.description.stitches,
        nodes=np.array([[0, 30, 31, 33]], dtype=np.int32),
        weights=np.array([[0.2, 0.3, 0.5]]),
    )
    description = replace(fake.snapshot.description, stitches=drawn)
    stage = Stage(server, RenderFrameBuilder().frame(fake.show(description=description)), ViewOptions())
    assert stage.options.stitches
    x = fake.snapshot.positions
    points = server.scene._handle_from_node_name["/stitches"].points
    np.testing.assert_allclose(points, [[x[0], [0.2, 0.3, 0.5] @ x[[30, 31, 33]]]], atol=1e-6)


@pytest.mark.parametrize(("meters", "text"), [(1.234, "1.23 m"), (0.123, "12.3 cm"), (0.00123, "1.2 mm")])
def test_units_of_lengths(meters, text):
    assert length_text(meters) == text


@pytest.mark.parametrize(("axis", "place"), [(0, 0.5), (1, 0.37), (2, 0.81), (0, 1.0)])
def test_a_cut_is_a_closed_surface_with_a_plane_section(fake, axis, place):
    model = RenderFrameBuilder().frame(fake.snapshot).model
    drawn = surface(model, Cut(axis, place))
    corners = drawn.corners(model.rest_positions)
    a, b, c = corners.transpose(1, 0, 2)
    area = 0.5 * np.cross(b - a, c - a)
    np.testing.assert_allclose(area.sum(axis=0), 0.0, atol=1e-9)  # closed
    assert np.einsum("ij,ij->i", a, area).sum() / 3.0 == pytest.approx(2.0 * place)  # the volume of two unit cubes
    for body in model.bodies:
        own = (drawn.owner >= body.tets.start) & (drawn.owner < body.tets.stop)
        along = model.rest_positions[body.vertices, axis]
        plane = along.min() + place * np.ptp(along)
        assert corners[own][..., axis].max() <= plane + 1e-8
        on_plane = own & (np.abs(corners[..., axis] - plane).max(axis=1) < 1e-8)
        assert area[on_plane, axis].sum() == pytest.approx(1.0)  # the whole section
    # The section follows the motion of its tets.
    moved = 2.0 * model.rest_positions + np.array([1.0, 2.0, 3.0])
    np.testing.assert_allclose(drawn.corners(moved), 2.0 * corners + np.array([1.0, 2.0, 3.0]))
    assert len(exploded_facets(model).owner) == 4 * len(model.tets)


def test_forces_are_arrows_with_a_scale(server, fake):
    translator = RenderFrameBuilder()
    points, forces = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]), np.array([[0.0, 30.0, 0.0], [0.0, 0.0, 15.0]])
    stage = Stage(server, translator.frame(fake.show(contact_forces=(points, forces))), ViewOptions(contacts=True))
    arrows = server.scene._handle_from_node_name["/forces"]
    unit = 0.5 * stage.model.view.radius / 50.0
    assert stage.force_scale == 50.0
    np.testing.assert_allclose(arrows.points, np.stack([points, points + unit * forces], axis=1), rtol=1e-6)
    stage.show(translator.frame(fake.show(contact_forces=(points, 0.5 * forces))))
    assert stage.force_scale == 50.0
    stage.show(translator.frame(fake.show(contact_forces=(points, 10.0 * forces))))
    assert stage.force_scale == 500.0
    stage.show(translator.frame(fake.show(contact_forces=None)))
    assert stage.force_scale is None
    assert not arrows.visible


def test_a_room_is_drawn_open(server, fake):
    room = sp.obstacles.Sphere(radius=3.0, inside=True, name="bowl")
    Stage(
        server,
        RenderFrameBuilder().frame(fake.show(description=replace(fake.snapshot.description, obstacles=(room,)))),
        ViewOptions(),
    )
    bowl = server.scene._handle_from_node_name["/obstacles/0 bowl"]
    assert (bowl.side, bowl.opacity) == ("back", None)
    a, b, c = (np.asarray(bowl.vertices, dtype=np.float64)[bowl.faces[:, k]] for k in range(3))
    assert np.einsum("ij,ij->", a, np.cross(b, c)) > 0.0  # faces outwards: only the inside of the far wall is drawn
    assert bowl.vertices[:, 1].max() == pytest.approx(0.0, abs=1e-6)  # the lower half
    rim = server.scene._handle_from_node_name["/obstacles/1 bowl, rim"]
    away = np.hypot(rim.vertices[:, 0], rim.vertices[:, 2])
    assert 2.0 < away.min() < away.max() < 4.0
