"""The gate before viser's server: it lets in only those who hold the token of a page, and limits what they send.

The server listens on the loopback interface. Other users of the machine reach it there, and so do pages of other sites
in the user's browser. Who passes the gate is the user, whose messages are not checked again.
"""

from __future__ import annotations

import hmac
import http
import logging
import secrets
from collections.abc import Awaitable, Callable
from typing import Any
from urllib.parse import parse_qs, urlsplit

logger = logging.getLogger(__name__)

_HOSTS = ("localhost", "127.0.0.1", "::1")
LARGEST_MESSAGE = 32 * 2**20  # of a browser, of which pictures are the largest [bytes]
_HEADERS = {
    "Referrer-Policy": "no-referrer",  # the address contains the token
    "X-Content-Type-Options": "nosniff",
    # A page of another site may not show this one within itself, where clicks would be led astray.
    "Content-Security-Policy": "frame-ancestors 'none'",
    "X-Frame-Options": "DENY",
}
_NOT_ALLOWED, _ERROR = 1008, 1011  # for closing a connection, RFC 6455 section 7.4.1

Handler = Callable[[Any], Awaitable[None]]


def new_token() -> str:
    """A secret for the address of a page."""
    return secrets.token_urlsafe(18)


class Gate:
    """Decides on requests, by their address and their headers.

    Parameters
    ----------
    token : the address, or the cookie that the page sets, must contain it
    """

    def __init__(self, token: str) -> None:
        self._token = token.encode()

    def refusal(self, path: str, headers: Any) -> str | None:
        """Why a request is refused, or None."""
        hosts, origins = headers.get_all("Host"), headers.get_all("Origin")
        if len(hosts) != 1 or _address(hosts[0])[0] not in _HOSTS:
            # A page of another site whose host name resolves to this machine (DNS rebinding).
            return "this page is served on this machine only: use http://localhost"
        if any(urlsplit(origin).netloc.lower() != hosts[0].lower() for origin in origins):
            return "a page of another site may not use this one"
        if not self.holds_token(path) and not self._is_cookie(headers.get_all("Cookie"), hosts[0]):
            return "the address needs its token (?token=...); use the address in the terminal"
        return None

    def holds_token(self, path: str) -> bool:
        """Whether the address contains the token."""
        return any(self._is_token(item) for item in parse_qs(urlsplit(path).query).get("token", []))

    def answering(self, process_request: Any) -> Callable[[Any, Any], Any]:
        """The answer of the server to HTTP requests, after the check."""

        def answer(connection: Any, request: Any) -> Any:
            why = self.refusal(request.path, request.headers)
            if why is not None:
                return connection.respond(http.HTTPStatus.FORBIDDEN, f"Supple: {why}\n")
            response = process_request(connection, request)
            if response is not None:
                for name, value in _HEADERS.items():
                    response.headers[name] = value
                if self.holds_token(request.path):
                    # The browser also sends it when it opens the websocket.
                    cookie = f"{_cookie_name(request.headers['Host'])}={self._token.decode()}"
                    response.headers["Set-Cookie"] = f"{cookie}; HttpOnly; SameSite=Strict; Path=/"
            return response

        return answer

    def _is_cookie(self, lines: list[str], host: str) -> bool:
        pairs = (pair.strip().partition("=") for line in lines for pair in line.split(";"))
        return any(name == _cookie_name(host) and self._is_token(value) for name, _, value in pairs)

    def _is_token(self, value: str) -> bool:
        return hmac.compare_digest(value.encode("utf-8", "replace"), self._token)


def _address(host: str) -> tuple[str, int | None]:
    """The name and the port of a Host header; "" where it has none."""
    try:
        parts = urlsplit("//" + host)
        return parts.hostname or "", parts.port
    except ValueError:
        return "", None


def _cookie_name(host: str) -> str:
    # Browsers send cookies to every port of a host: each server has its own cookie.
    return f"supple-{_address(host)[1] or 80}"


class _File(Exception):
    """A file, which no page takes."""


def limited(handler: Handler) -> Handler:
    """The handler of connections of viser: one that sends nonsense, or a file, is closed in one line."""

    async def handle(connection: Any) -> None:
        connection.recv = _without_files(connection.recv)
        try:
            await handler(connection)
        except _File:
            await connection.close(_NOT_ALLOWED, "this page takes no files")
        except Exception as error:
            logger.warning("a browser was disconnected: %s: %s", type(error).__name__, error)
            await connection.close(_ERROR, "an error of the server")

    return handle


def _without_files(receive: Callable[[], Awaitable[Any]]) -> Callable[[], Awaitable[Any]]:
    """Receives the next message; raises `_File` where a file begins."""

    async def received() -> Any:
        raw = await receive()
        if b"FileTransferStartUpload" in raw[:512]:
            raise _File
        return raw

    return received
