"""What the server of the page lets in: requests of this machine's own browser, with the token of the link."""

from __future__ import annotations

import hmac

from starlette.datastructures import URL
from starlette.requests import HTTPConnection
from starlette.responses import PlainTextResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Receive, Scope, Send

LARGEST_BODY = 512 * 2**20  # bytes of a request: a trace of 10 million rows


class Guard:
    """ASGI middleware that refuses every request that does not come from the page itself.

    A request passes if its Host is this server's (a name that an attacker points at 127.0.0.1 is not), its Origin, if
    the browser sends one, is the page's own, and it has the token: in the link, from which it becomes a cookie, or in
    this cookie. A body that is too long, or that does not state its length, is refused before it is read.
    """

    def __init__(self, app: ASGIApp, port: int, token: str) -> None:
        self.app, self.token = app, token
        self.hosts = {f"127.0.0.1:{port}", f"localhost:{port}"}
        self.cookie = f"guideload-{port}"  # the ports of a host share their cookies

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        response = self._response(HTTPConnection(scope))
        if response is None:
            await self.app(scope, receive, send)
        elif scope["type"] == "http":
            await response(scope, receive, send)
        else:
            await receive()
            await send({"type": "websocket.close", "code": 1008})

    def _response(self, asked: HTTPConnection) -> Response | None:
        """What is sent in place of the page; None for a request that passes."""
        headers = asked.headers
        if headers.get("host", "") not in self.hosts:
            return PlainTextResponse("This page answers to 127.0.0.1 only.", 403)
        origin = headers.get("origin")
        if origin is not None and origin.removeprefix("http://") not in self.hosts:
            return PlainTextResponse("This page answers to itself only.", 403)
        if asked.scope["type"] == "http" and self._is_token(asked.query_params.get("token", "")):
            rest = URL(scope=asked.scope).remove_query_params("token").query
            path = "/" + asked.scope["path"].lstrip("/")  # "//name" would lead to another host
            link = RedirectResponse(path + (f"?{rest}" if rest else ""), 303)
            link.set_cookie(self.cookie, self.token, httponly=True, samesite="strict")
            return link
        if not self._is_token(asked.cookies.get(self.cookie, "")):
            words = "Open the link that `guideload app` printed: it holds the token of this session."
            return PlainTextResponse(words, 403)
        length = headers.get("content-length", "0")
        if "transfer-encoding" in headers or not length.isdecimal() or int(length) > LARGEST_BODY:
            words = f"A file may have at most {LARGEST_BODY // 2**20} MB; for more: guideload long-run."
            return PlainTextResponse(words, 413)
        return None

    def _is_token(self, given: str) -> bool:
        return hmac.compare_digest(given.encode(), self.token.encode())
