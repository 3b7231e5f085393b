"""What viser's page looks like."""

from __future__ import annotations

from typing import Any


def set_theme(server: Any, dark: bool) -> None:
    """Make the page bright or dark, for all its visitors, without links of viser."""
    server.gui.configure_theme(show_logo=False, show_share_button=False, brand_color=(36, 108, 168), dark_mode=dark)
