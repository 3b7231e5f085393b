"""What is above the picture: the start, the state, the legend, and warnings; the theme, and texts in Markdown.

They are parts of one HTML element of the panel, which a style sheet places above the picture. A button there is the
label of a button of the panel: a click on it presses that one.
"""

from __future__ import annotations

import html
import threading
from typing import Any

_STYLE = """
.supple { position: fixed; z-index: 5; left: 10px; font: 13px/1.4 system-ui, sans-serif; color: #24292f;
  background: #fffd; border-radius: 8px; padding: 5px 10px;
  --warning: #963c04; --energy: #755200; --smallest: #14663a; }
[data-mantine-color-scheme="dark"] .supple { color: #e6e8eb; background: #1d1f22dd; --warning: #ffa94d;
  --energy: #e0b040; --smallest: #6fcf97; }
.supple label { cursor: pointer; border-radius: 6px; padding: 4px 12px; color: #fff; background: #12805c;
  white-space: nowrap; }
#supple-start { left: max(10px, calc(50% - 360px)); bottom: 12%; background: none; }
#supple-start label { display: block; font-size: min(22px, 4.2vw); padding: 14px 28px; border-radius: 12px; }
#supple-state { top: 6px; }
#supple-state svg { display: block; width: 150px; height: 24px; fill: none; stroke: currentColor; }
#supple-state .energy { color: var(--energy); }
#supple-state .smallest { color: var(--smallest); }
#supple-state .row { display: flex; gap: 12px; }
#supple-warning, #supple-busy { top: 84px; max-width: min(360px, calc(100% - 40px)); color: var(--warning);
  font-weight: 600; }
#supple-busy { top: 40%; }
#supple-legend { bottom: 12px; }
#supple-legend .bar { height: 12px; width: min(220px, 60vw); border-radius: 3px; }
#supple-legend .numbers { display: flex; justify-content: space-between; font-variant-numeric: tabular-nums; }
#supple-arrows { bottom: 84px; }
"""


class Overlay:
    """The parts above the picture, by name.

    Parameters
    ----------
    gui : of viser
    """

    def __init__(self, gui: Any) -> None:
        self._lock = threading.Lock()
        self._parts: dict[str, str] = {}
        self._style = f"<style>{_STYLE}</style>"
        self._handle = gui.add_html(self._style)

    def show(self, name: str, content: str) -> None:
        """Draw the HTML of a part; "" removes it."""
        with self._lock:
            made = f'<div id="supple-{name}" class="supple">{content}</div>' if content else ""
            if self._parts.get(name, "") != made:
                self._parts[name] = made
                self._handle.content = self._style + "".join(self._parts.values())

    def part(self, name: str) -> str:
        """The HTML of a part, or ""."""
        return self._parts.get(name, "")


def button(text: str, handle: Any) -> str:
    """A button above the picture that presses a button of the panel."""
    return f'<label for="{handle._impl.uuid}">{html.escape(text)}</label>'


def plain(text: str) -> str:
    """Markdown that displays exactly this text. Browsers interpret HTML in Markdown, and names can contain anything."""
    return "".join(c if c.isalnum() or c in " .,:;'()/-+=%" else f"&#{ord(c)};" for c in text)


def set_theme(server: Any, dark: bool) -> None:
    """Make the page bright or dark, for all its visitors, without links of viser."""
    server.gui.configure_theme(show_logo=False, show_share_button=False, brand_color=(36, 108, 168), dark_mode=dark)
