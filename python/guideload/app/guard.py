"""What the server of the page lets in: requests of this machine's own browser, with the token of the link."""

from __future__ import annotations

import hmac
from collections.abc import Awaitable, Callable, MutableMapping
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import parse_qs, urlencode

Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
App = Callable[[Message, Receive, Send], Awaitable[None]]

LARGEST_BODY = 512 * 2**20  # bytes of a request: a trace of 10 million rows


class Guard:
    """ASGI middleware that refuses every request that does not come from the page itself.

    A request passes if its Host is this server's (a name that an attacker points at 127.0.0.1 is not), its Origin, if
    the browser sends one, is the page's own, and it has the token: in the link, from which it becomes a cookie, or in
    this cookie. A body that is too long, or that does not state its length, is refused before it is read.
    """

    def __init__(self, app: App, port: int, token: str) -> None:
        self.app, self.token = app, token
        self.hosts = {f"127.0.0.1:{port}", f"localhost:{port}"}
        self.cookie = f"guideload-{port}"  # the ports of a host share their cookies

    async def __call__(self, scope: Message, receive: Receive, send: Send) -> None:
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
        elif (refusal := self.refusal(scope)) is not None:
            await _refuse(scope, receive, send, *refusal)
        elif scope["type"] == "http" and (link := self._with_token(scope)) is not None:
            cookie = f"{self.cookie}={self.token}; Path=/; HttpOnly; SameSite=Strict"
            await _answer(send, 303, b"", (b"location", link.encode()), (b"set-cookie", cookie.encode()))
        else:
            await self.app(scope, receive, send)

    def refusal(self, scope: Message) -> tuple[int, str] | None:
        """Status and reason, if the request is refused."""
        headers = _headers(scope)
        if headers.get("host", "") not in self.hosts:
            return 403, "This page answers to 127.0.0.1 only."
        origin = headers.get("origin")
        if origin is not None and origin.removeprefix("http://") not in self.hosts:
            return 403, "This page answers to itself only."
        given = self._with_token(scope) is not None or self._is_token(_cookies(headers).get(self.cookie, ""))
        if not given:
            return 403, "Open the link that `guideload app` printed: it holds the token of this session."
        length = headers.get("content-length", "0")
        if "transfer-encoding" in headers or not length.isdecimal() or int(length) > LARGEST_BODY:
            return 413, f"A file may have at most {LARGEST_BODY // 2**20} MB; for more: guideload long-run."
        return None

    def _with_token(self, scope: Message) -> str | None:
        """The path without the token, if its query has the right one."""
        query = parse_qs(scope.get("query_string", b"").decode("latin-1"))
        if not self._is_token(*query.pop("token", [""])[:1]):
            return None
        rest = urlencode(query, doseq=True)
        path = "/" + str(scope["path"]).lstrip("/")  # "//name" would lead to another host
        return path + (f"?{rest}" if rest else "")

    def _is_token(self, given: str) -> bool:
        return hmac.compare_digest(given.encode(), self.token.encode())


def _headers(scope: Message) -> dict[str, str]:
    return {name.decode("latin-1").lower(): value.decode("latin-1") for name, value in scope["headers"]}


def _cookies(headers: dict[str, str]) -> dict[str, str]:
    try:
        return {name: one.value for name, one in SimpleCookie(headers.get("cookie", "")).items()}
    except CookieError:
        return {}


async def _refuse(scope: Message, receive: Receive, send: Send, status: int, reason: str) -> None:
    if scope["type"] == "websocket":
        await receive()
        await send({"type": "websocket.close", "code": 1008})
    else:
        await _answer(send, status, reason.encode(), (b"content-type", b"text/plain; charset=utf-8"))


async def _answer(send: Send, status: int, body: bytes, *headers: tuple[bytes, bytes]) -> None:
    await send({"type": "http.response.start", "status": status, "headers": list(headers)})
    await send({"type": "http.response.body", "body": body})
