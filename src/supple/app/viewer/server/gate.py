"""Access control and message limits in front of the server of viser, on the same port.

Limits and an access check are added to the call with which viser serves (`serving_with`).
"""

from __future__ import annotations

import asyncio
import contextlib
import hmac
import http
import ipaddress
import logging
import os
import secrets
import socket
import time
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any
from urllib.parse import parse_qs, urlsplit

from supple.app.viewer.protocol import limits
from supple.app.viewer.server.connection_limit import bounded_connections
from supple.app.viewer.server.message_check import Malformed, is_wanted
from supple.app.viewer.server.page.served_page import ServedPage
from supple.errors import OutputError
from supple.results.viser_server import serving_with

logger = logging.getLogger(__name__)

# Status codes for closing a connection, RFC 6455 section 7.4.1.
_POLICY, _TRY_LATER, _ERROR = 1008, 1013, 1011


def new_token() -> str:
    """A secret for the address of a page."""
    return secrets.token_urlsafe(18)


def is_loopback(host: str) -> bool:
    """Whether a server that listens at `host` can be reached from this machine only."""
    if host.lower() == "localhost":
        return True
    try:
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return False


def require_free_port(host: str, port: int) -> None:
    """Raise `OutputError` where no server can listen at this host and port; port 0 is any free port."""
    try:
        family, kind, protocol, _, place = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        with socket.socket(family, kind, protocol) as probe:
            if os.name == "posix":
                probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # a recently closed port counts as free
            probe.bind(place)
    except (OSError, UnicodeError) as error:
        remedy = "choose another --port" if port else "choose another --host"
        raise OutputError(
            f"cannot serve at {host}, port {port} ({getattr(error, 'strerror', None) or error}); {remedy}"
        ) from None


def first_free_port(host: str, start: int, tries: int = 20) -> int:
    """The first port from `start` on at which a server can listen.

    Raises
    ------
    OutputError : where none of `tries` ports is free.
    """
    for port in range(start, start + tries - 1):
        with contextlib.suppress(OutputError):
            require_free_port(host, port)
            return port
    require_free_port(host, start + tries - 1)
    return start + tries - 1


@dataclass(frozen=True)
class AccessCheck:
    """Decides on requests for a connection.

    Attributes
    ----------
    token : the address, or the cookie that the first page sets, must contain it; None: no token is needed
    """

    token: str | None = None

    def denial(self, path: str, headers: Any) -> str | None:
        """Why a request is refused, or None."""
        host = headers.get("Host", "")
        if not path.isascii():
            return "no address of this page has such letters"
        if self.token is None and not is_loopback(_hostname(host)):
            # A page of another site whose host name resolves to this machine (DNS rebinding).
            return "this page is served on this machine only: use http://localhost"
        origin = headers.get("Origin")
        if _is_websocket(headers) and origin is not None and urlsplit(origin).netloc.lower() != host.lower():
            return "a page of another site may not control this simulation"
        if self.token is not None and not (self.holds_token(path) or self._has_cookie(headers)):
            return "the address needs its token (?token=...); use the address in the terminal"
        return None

    def holds_token(self, path: str) -> bool:
        """Whether the address contains the token."""
        return any(self._is_token(each) for each in parse_qs(urlsplit(path).query).get("token", []))

    def cookie(self, headers: Any) -> str | None:
        """The cookie with the token, which the browser also sends when it opens the websocket."""
        if self.token is None:
            return None
        return f"{_cookie_name(headers)}={self.token}; HttpOnly; SameSite=Strict; Path=/"

    def _has_cookie(self, headers: Any) -> bool:
        for line in headers.get_all("Cookie"):
            for pair in line.split(";"):
                name, _, value = pair.strip().partition("=")
                if name == _cookie_name(headers) and self._is_token(value):
                    return True
        return False

    def _is_token(self, value: str) -> bool:
        return self.token is not None and hmac.compare_digest(value.encode(), self.token.encode())


def _cookie_name(headers: Any) -> str:
    # Browsers send cookies to every port of a host: each server has its own cookie.
    return f"supple-{urlsplit('//' + headers.get('Host', '')).port or 80}"


def _hostname(host: str) -> str:
    try:
        return urlsplit("//" + host).hostname or ""
    except ValueError:
        return ""


def _is_websocket(headers: Any) -> bool:
    return headers.get("Upgrade", "").lower() == "websocket"


@contextmanager
def gate(host: str, token: str | None = None, page: ServedPage | None = None) -> Iterator[None]:
    """Start the server of viser within this block: it gets an access check and limits for incoming messages.

    Parameters
    ----------
    host : where it will listen; where other machines can reach it, a token is needed.
    page : that browsers get; None: that of viser

    Raises
    ------
    OutputError : where a token is missing, or the server that was started cannot be protected.
    """
    if token is None and not is_loopback(host):
        raise OutputError(f"a page at {host} can be reached from other machines; it needs a token")
    access = AccessCheck(token)
    clients: set[Any] = set()

    def protected(serve: Callable[..., Any]) -> Callable[..., Any]:
        def changed(handler: Any, *arguments: Any, process_request: Any = None, **options: Any) -> Any:
            # A browser that floods the server does not answer a closing handshake: the server does not wait for it.
            options |= {"max_size": limits.LARGEST_PICTURE, "max_queue": 16, "close_timeout": 1.0}
            options["create_connection"] = bounded_connections(limits.MOST_CONNECTIONS)
            asyncio.get_running_loop().set_exception_handler(_log_quietly)
            answer = _guarded(process_request, access, page)
            return serve(_watched(handler, clients), *arguments, process_request=answer, **options)

        return changed

    with serving_with(protected):
        yield


def _guarded(process_request: Any, access: AccessCheck, page: ServedPage | None) -> Callable[[Any, Any], Any]:
    """The answer of the server to HTTP requests, after the access check."""

    def answer(connection: Any, request: Any) -> Any:
        why = access.denial(request.path, request.headers)
        if why is not None:
            logger.info("request refused: %s", why)
            return connection.respond(http.HTTPStatus.FORBIDDEN, f"Supple: {why}\n")
        response = None if process_request is None else process_request(connection, request)
        cookie = access.cookie(request.headers)
        if response is not None and cookie is not None and access.holds_token(request.path):
            response.headers["Set-Cookie"] = cookie
        if response is not None:
            response.headers["Referrer-Policy"] = "no-referrer"  # the address contains a secret
            response.headers["X-Content-Type-Options"] = "nosniff"
            # A page of another site may not show this one within itself, where clicks would be led astray.
            response.headers["Content-Security-Policy"] = "frame-ancestors 'none'"
            response.headers["X-Frame-Options"] = "DENY"
            if page is not None:
                page.replace(response)
        return response

    return answer


def _watched(handler: Callable[[Any], Awaitable[None]], clients: set[Any]) -> Callable[[Any], Awaitable[None]]:
    """The connection handler of viser, which gets only well-formed messages, and no more than a person can send."""

    async def watch(connection: Any) -> None:
        if len(clients) >= limits.MOST_CLIENTS:
            await connection.close(_TRY_LATER, "too many pages are open")
            return
        clients.add(connection)
        connection.recv = _checked(connection.recv)
        try:
            await handler(connection)
        except Malformed as error:
            logger.info("a browser was disconnected because of a malformed message: %s", error)
            await connection.close(_POLICY, "malformed message")
        except Exception as error:
            logger.warning("a browser was disconnected: %s: %s", type(error).__name__, error)
            await connection.close(_ERROR, "an error of the server")
        finally:
            clients.discard(connection)

    return watch


def _checked(receive: Callable[[], Awaitable[Any]]) -> Callable[[], Awaitable[bytes]]:
    """Receives the next well-formed message of a kind that the page uses.

    Raises `Malformed` where one is malformed, messages come faster than any page sends them, or the first one, which a
    page sends when it is open, does not come.
    """
    first_by = time.monotonic() + limits.FIRST_MESSAGE
    greeted = False
    allowance = Allowance(limits.MESSAGES_PER_SECOND, limits.MESSAGES_AT_ONCE)

    async def checked() -> bytes:
        nonlocal greeted
        while True:
            try:
                raw = await (receive() if greeted else asyncio.wait_for(receive(), first_by - time.monotonic()))
            except TimeoutError:
                raise Malformed("it sent nothing") from None
            if not allowance.take(time.monotonic()):
                raise Malformed("more messages than a page sends")
            if len(raw) > limits.LARGEST_MESSAGE:
                # Large messages are read slowly, without effect on other browsers.
                await asyncio.sleep(len(raw) / limits.LARGE_MESSAGES_PER_SECOND)
            if is_wanted(raw):
                greeted = True
                return raw

    return checked


class Allowance:
    """A token bucket: `most` at once, refilled at a rate per second."""

    def __init__(self, rate: float, most: float) -> None:
        self.rate, self.most = rate, most
        self._left = most
        self._when: float | None = None

    def take(self, now: float) -> bool:
        """Take one; False where none is left at the time `now` [s]."""
        if self._when is not None:
            self._left = min(self.most, self._left + (now - self._when) * self.rate)
        self._when = now
        if self._left < 1.0:
            return False
        self._left -= 1.0
        return True


def _log_quietly(loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
    """Log an error in the handling of one message as one line, without a stack trace."""
    error = context.get("exception")
    logger.warning("the page: %s", f"{type(error).__name__}: {error}" if error else context.get("message"))
