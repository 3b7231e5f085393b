"""What is drawn above the picture: the start, the state, the legend, and the buttons of a phone.

It is the content of an HTML element of the panel that is not displayed there; `server/page/page.js` draws its parts
above the picture. A button there names an input of the panel, which gets a value when it is pressed.
"""

from __future__ import annotations

import html
import threading
from typing import Any

_MARK = '<div class="supple-overlay">'


class Overlay:
    """The parts above the picture, by name.

    Parameters
    ----------
    gui : of viser: of the server for all visitors, of a client for one
    """

    def __init__(self, gui: Any) -> None:
        self._lock = threading.Lock()
        self._parts: dict[str, str] = {}
        self._handle = gui.add_html(_MARK + "</div>", visible=False)

    def show(self, name: str, content: str, **data: str) -> None:
        """Draw the HTML of a part; "" removes it. `data` are further attributes, `data-...`, of its element."""
        with self._lock:
            attributes = "".join(f' data-{key}="{html.escape(value)}"' for key, value in data.items())
            made = f'<div id="supple-{name}"{attributes}>{content}</div>' if content else ""
            if self._parts.get(name, "") != made:
                self._parts[name] = made
                self._handle.content = f"{_MARK}{''.join(self._parts.values())}</div>"

    def part(self, name: str) -> str:
        """The HTML of a part, or ""."""
        return self._parts.get(name, "")


def button(text: str, handle: Any, value: str | None = None, label: str | None = None) -> str:
    """A button above the picture that sets an input of the panel.

    Parameters
    ----------
    handle : of the input, a button or a button group; value : of the group
    label : for people who do not see it
    """
    chosen = "" if value is None else f' data-value="{html.escape(value)}"'
    named = "" if label is None else f' aria-label="{html.escape(label)}"'
    return f'<button data-press="{handle._impl.uuid}"{chosen}{named}>{html.escape(text)}</button>'
