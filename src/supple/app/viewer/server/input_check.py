"""Checks the values that browsers set for the inputs of the panel.

viser sends every value to all other visitors, also to later ones. A value that cannot be sent would end the page for
all of them.
"""

from __future__ import annotations

import math
from typing import Any

LONGEST_TEXT = 1000


def is_offered(handle: Any, value: object) -> bool:
    """Whether a value is allowed for an input of the panel.

    Parameters
    ----------
    handle : of a slider, check box, dropdown, text, number or button
    """
    if isinstance(value, bool):
        return isinstance(handle.value, bool)
    if isinstance(value, str):
        options = getattr(handle, "options", None)
        return value in options if options is not None else isinstance(handle.value, str) and len(value) < LONGEST_TEXT
    if isinstance(value, (int, float)):
        if isinstance(handle.value, bool) or not isinstance(handle.value, (int, float)) or not math.isfinite(value):
            return False
        low, high = getattr(handle, "min", None), getattr(handle, "max", None)
        slack = 1e-6 * max(1.0, abs(value))  # a browser rounds values to steps
        return (low is None or value >= low - slack) and (high is None or value <= high + slack) and abs(value) < 1e15
    return False


def guard_inputs(server: Any) -> None:
    """Ignore all updates of inputs with values that are not allowed."""
    from viser import _messages

    handlers = server._websock_server._incoming_handlers
    handlers[_messages.GuiUpdateMessage] = [_guarded(server, passed) for passed in handlers[_messages.GuiUpdateMessage]]


def _guarded(server: Any, handler: Any) -> Any:
    async def guarded(client_id: Any, message: Any) -> None:
        if not isinstance(message.uuid, str) or not isinstance(message.updates, dict):
            return
        handle = server.gui._gui_input_handle_from_uuid.get(message.uuid)
        if handle is not None and set(message.updates) == {"value"} and is_offered(handle, message.updates["value"]):
            await handler(client_id, message)

    return guarded
