"""Inputs accept only allowed values."""

import math

import pytest

from supple.app.viewer.server.input_check import is_offered


@pytest.mark.parametrize(
    ("value", "offered"),
    [
        *((value, True) for value in (3, 3.0, 2.0, 10.0)),
        *((value, False) for value in (10.1, 1e30, -1e300, math.nan, math.inf, True, "3", None, [3], {})),
    ],
)
def test_sliders(server, value, offered):
    assert is_offered(server.gui.add_slider("s", 2.0, 10.0, 0.1, initial_value=3.0), value) is offered


@pytest.mark.parametrize(("value", "offered"), [("a", True), ("c", False), (1, False), (None, False), (["a"], False)])
def test_dropdowns_and_groups_of_buttons(server, value, offered):
    assert is_offered(server.gui.add_dropdown("d", ("a", "b"), initial_value="a"), value) is offered
    assert is_offered(server.gui.add_button_group("g", ("a", "b")), value) is offered


@pytest.mark.parametrize(("value", "offered"), [(True, True), (False, True), (1, False), ("on", False)])
def test_buttons_and_check_boxes(server, value, offered):
    assert is_offered(server.gui.add_checkbox("c", initial_value=False), value) is offered
    assert is_offered(server.gui.add_button("b"), value) is offered


def test_invalid_values_do_not_affect_other_visitors(server, visit, until):
    count = server.gui.add_slider("count", 1, 9, 1, initial_value=2)
    visitors = [visit(server.get_port()) for _ in range(2)]
    until(lambda: len(server.get_clients()) == 2)
    heard = []
    count.on_update(lambda event: heard.append(event.target.value))
    visitors[0].set(count, 1e30)  # as an integer it is too large to be sent to the others
    visitors[0].send("GuiUpdateMessage", uuid=count._impl.uuid, updates={"update_cb": None, "value": 3})
    visitors[0].set(count, 5)
    until(lambda: heard == [5])
    visitors[1].set(count, 6)
    until(lambda: heard == [5, 6])
    for visitor in visitors:
        visitor.leave()
