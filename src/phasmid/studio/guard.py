"""Access to the live page: hosts, origins, the token, and headers of every response."""

from __future__ import annotations

import hmac
import ipaddress
import logging
import socket

from starlette.datastructures import MutableHeaders
from starlette.requests import HTTPConnection
from starlette.responses import PlainTextResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocket

from phasmid.errors import InvalidInput, plain

POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
"""Content security policy of the page: it loads nothing from elsewhere."""

HEADERS = {
    "Cache-Control": "no-store",
    "Content-Security-Policy": POLICY,
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}

log = logging.getLogger("phasmid.studio")


class Guard:
    """Middleware that admits only browsers that opened the address with the token.

    Args:
        app: Application behind it.
        hosts: Accepted values of the header Host, besides the address of the connection. A name
            that someone else points at this machine is none of them.
        token: Token in the address, and in the cookie from then on.
        cookie: Name of the cookie.
    """

    def __init__(self, app: ASGIApp, *, hosts: frozenset[str], token: str, cookie: str) -> None:
        self._app, self._hosts, self._token, self._cookie = app, hosts, token, cookie

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Refuse a request, or pass it on; add the headers to its response."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return

        async def send_guarded(message: Message) -> None:
            if message["type"].endswith("http.response.start"):
                headers = MutableHeaders(scope=message)
                for name, value in HEADERS.items():
                    headers.setdefault(name, value)
            await send(message)

        response = self._check(HTTPConnection(scope))
        if response is None:
            await self._app(scope, receive, send_guarded)
        elif scope["type"] == "websocket":
            await WebSocket(scope, receive, send_guarded).send_denial_response(response)
        else:
            await response(scope, receive, send_guarded)

    def _check(self, request: HTTPConnection) -> Response | None:
        """Return the refusal of a request, or the redirection from the address with the token."""
        hosts, origins = request.headers.getlist("host"), request.headers.getlist("origin")
        arrived = host_header(*request.scope["server"])
        if len(hosts) != 1 or hosts[0] not in self._hosts | {arrived}:
            return _forbidden("host", hosts)
        # Browsers send the origin of a page with each websocket.
        is_socket = request.scope["type"] == "websocket"
        if (origins or is_socket) and origins != [f"http://{hosts[0]}"]:
            return _forbidden("origin", origins)
        query = request.scope["query_string"].decode("latin-1")
        if request.scope["path"] == "/" and query:
            if not self._is_token(query.removeprefix("token=")):
                return _unknown()
            response = RedirectResponse("/", 303)
            response.set_cookie(self._cookie, self._token, httponly=True, samesite="strict")
            return response
        return None if self._is_token(request.cookies.get(self._cookie, "")) else _unknown()

    def _is_token(self, text: str) -> bool:
        # In constant time: the duration tells nothing about the token.
        return hmac.compare_digest(text.encode(), self._token.encode())


def refusal(status: int, text: str) -> PlainTextResponse:
    """Return a response of one sentence."""
    return PlainTextResponse(f"{text}\n", status)


def _forbidden(header: str, values: list[str]) -> Response:
    found = plain(", ".join(values))[:100] or "none"
    log.warning("refused a request of %s %s.", header, found)
    return refusal(403, "forbidden.")


def _unknown() -> Response:
    return refusal(401, "open the address that phasmid studio printed: it carries the token.")


def names_of(host: str, port: int) -> tuple[str, ...]:
    """Return the values of the header Host that every connection accepts; the first is printed.

    Args:
        host: Name or number at which the server listens.
        port: Its port.
    """
    names = [host]
    if is_loopback(host):
        names += ["localhost"]
    elif _number_of(host).is_unspecified:
        names = ["127.0.0.1", "localhost", socket.gethostname().lower()]
    return tuple(host_header(name, port) for name in names)


def host_header(host: str, port: int) -> str:
    """Return the header Host that a browser sends for a name or number and a port."""
    name = f"[{host}]" if ":" in host else host
    return name if port == 80 else f"{name}:{port}"


def address_of(host: str) -> tuple[socket.AddressFamily, str]:
    """Look up the address of a host.

    Raises:
        InvalidInput: There is none.
    """
    try:
        found = socket.getaddrinfo(host, None, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
    except (OSError, UnicodeError):
        what = f'--host is "{host}"; it must be a name or a number of this machine.'
        raise InvalidInput(what, hint="--host 127.0.0.1") from None
    family, _, _, _, address = found[0]
    return family, str(address[0])


def is_loopback(host: str) -> bool:
    """Return True if only this machine reaches a host."""
    return _number_of(host).is_loopback


def _number_of(host: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address:
    return ipaddress.ip_address(address_of(host)[1])
