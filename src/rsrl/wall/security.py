"""What keeps strangers out: Host and Origin are checked, another address than this machine needs a token, and the page may load nothing
from elsewhere."""

import hmac
import ipaddress
import socket
from collections.abc import Mapping
from http.cookies import CookieError, SimpleCookie
from typing import Any, Final
from urllib.parse import parse_qs, urlsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import PlainTextResponse, RedirectResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from rsrl.errors import RsrlError
from rsrl.wall.settings import LEAST_TOKEN

COOKIE: Final = "rsrl-wall"

POLICY: Final = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; connect-src 'self'; font-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)

HEADERS: Final[Mapping[str, str]] = {
    "content-security-policy": POLICY,
    "x-content-type-options": "nosniff",
    "x-frame-options": "DENY",
    "referrer-policy": "no-referrer",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "permissions-policy": "camera=(), microphone=(), geolocation=()",
}


def is_loopback(host: str) -> bool:
    """Whether only this machine can reach a server on this address."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def check_token(host: str, token: str | None) -> None:
    """Raise RsrlError where an address that others can reach has no token, or one that can be guessed."""
    if token is None and not is_loopback(host):
        raise RsrlError(f"--host {host} lets others in; give a --token of at least {LEAST_TOKEN} characters that they must know")
    if token is not None and (len(token) < LEAST_TOKEN or not token.isascii() or not token.isprintable() or set(token) & set(' ;,"\\')):
        raise RsrlError(f"--token: give at least {LEAST_TOKEN} letters, digits or signs, without spaces, quotes, commas and semicolons")


class Guard:
    """Middleware that answers strangers before the application sees them, and adds the headers.

    Args:
        host: that the server listens on. On an address of this machine alone, names of it are the only hosts; else also addresses and the
            machine's own name. No other name can be right: a page elsewhere may have made its own name point here.
    """

    def __init__(self, app: ASGIApp, host: str, token: str | None) -> None:
        self._app, self._host, self._token = app, host, token

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, or refuse it."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        why = self._refusal(scope, headers)
        if scope["type"] == "websocket":
            if why:
                await send({"type": "websocket.close", "code": 1008, "reason": why})
            else:
                await self._app(scope, receive, send)
            return
        answer: Any = self._app
        if why and self._asks_with_token(scope) and self.knows(headers.get("host", "")):
            answer = RedirectResponse("/", status_code=303)
            answer.set_cookie(COOKIE, str(self._token), httponly=True, samesite="strict")
        elif why:
            answer = PlainTextResponse(why + "\n", status_code=403)
        await answer(scope, receive, _with_headers(send))

    def _refusal(self, scope: Scope, headers: Headers) -> str:
        """Why a request is refused; "" where it is not."""
        if not self.knows(headers.get("host", "")):
            return "this server does not go by that name"
        origin = headers.get("origin")
        if (scope["type"] == "websocket" or origin is not None) and not _same_origin(origin, headers.get("host", "")):
            return "another page may not use this server"
        if self._token is not None and not self._has_token(headers):
            return "open the page by the address with the token"
        return ""

    def knows(self, host: str) -> bool:
        """Whether a Host header names this server."""
        name = _host_name(host)
        if name is None:
            return False
        if is_loopback(name):
            return True
        if is_loopback(self._host):
            return False
        if name in (self._host.lower(), socket.gethostname().lower()):
            return True
        try:
            ipaddress.ip_address(name)
        except ValueError:
            return False
        return True

    def _has_token(self, headers: Headers) -> bool:
        try:
            morsel = SimpleCookie(headers.get("cookie", "")).get(COOKIE)
        except CookieError:
            return False
        return morsel is not None and self._is_token(morsel.value)

    def _asks_with_token(self, scope: Scope) -> bool:
        """Whether the page is opened by the address that was printed, with the token in it."""
        given = parse_qs(scope.get("query_string", b"").decode("ascii", "replace")).get("token", [""])
        return self._token is not None and scope["path"] == "/" and self._is_token(given[0])

    def _is_token(self, given: str) -> bool:
        return hmac.compare_digest(given.encode(), str(self._token).encode())


def _host_name(host: str) -> str | None:
    """The name in a Host header, without the port; None for nonsense."""
    try:
        parts = urlsplit(f"//{host}")
        _ = parts.port
    except ValueError:
        return None
    return None if parts.username is not None or parts.path or not parts.hostname else parts.hostname.lower()


def _same_origin(origin: str | None, host: str) -> bool:
    """Whether a page comes from this server. A program that is no browser sends no origin; it has no reason to be here either."""
    if origin is None:
        return False
    parts = urlsplit(origin)
    return parts.scheme in ("http", "https") and bool(host) and parts.netloc.lower() == host.lower()


def _with_headers(send: Send) -> Send:
    async def sent(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            for name, value in HEADERS.items():
                headers[name] = value
        await send(message)

    return sent
