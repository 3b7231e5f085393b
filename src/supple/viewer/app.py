"""The page: a server that shows a running simulation, or a recording, in browsers."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from supple.viewer.live_source import LiveSource


@dataclass(frozen=True)
class Address:
    """Where the page is served.

    Attributes
    ----------
    host, port : of the server; port 0 takes any free one
    token : what the page's address must hold (`?token=...`); None where everyone who reaches it may see it
    """

    host: str = "127.0.0.1"
    port: int = 8080
    token: str | None = None


def serve(source: LiveSource | Path, address: Address, *, open_browser: bool = True) -> None:
    """Serve a live scene, or the recording at a path, until interrupted."""
    raise NotImplementedError
