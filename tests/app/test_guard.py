"""The server of the page answers its own browser alone."""

import asyncio
from typing import Any

import pytest

pytest.importorskip("starlette", reason="the extra guideload[app] is not installed")

from guideload.app.guard import LARGEST_BODY, Guard

PORT, TOKEN = 4711, "a-token"
OWN = {"host": f"127.0.0.1:{PORT}", "cookie": f"guideload-{PORT}={TOKEN}"}


def asked(
    headers: dict[str, str], query: str = "", path: str = "/", kind: str = "http"
) -> list[dict[str, Any]]:
    """What the guard sends; of a request that passes, the message of the page behind it."""
    sent: list[dict[str, Any]] = []

    async def page(scope: Any, receive: Any, send: Any) -> None:
        await send({"type": "passed"})

    async def send(message: Any) -> None:
        sent.append(message)

    async def receive() -> dict[str, Any]:
        return {"type": "websocket.connect"}

    scope = {
        "type": kind,
        "path": path,
        "query_string": query.encode(),
        "headers": [(name.encode(), value.encode()) for name, value in headers.items()],
    }
    asyncio.run(Guard(page, PORT, TOKEN)(scope, receive, send))
    return sent


@pytest.mark.parametrize("kind", ["http", "websocket"])
def test_the_page_passes_with_its_cookie(kind: str) -> None:
    assert asked(OWN, kind=kind) == [{"type": "passed"}]
    assert asked(OWN | {"origin": f"http://127.0.0.1:{PORT}"}, kind=kind) == [{"type": "passed"}]
    assert asked(OWN | {"host": f"localhost:{PORT}"}, kind=kind) == [{"type": "passed"}]


@pytest.mark.parametrize(
    "changed",
    [
        {"host": "evil.example"},  # a name that was pointed at 127.0.0.1
        {"host": f"evil.example:{PORT}"},
        {"host": "127.0.0.1:80"},
        {"host": ""},
        {"origin": "http://evil.example"},
        {"origin": "null"},
        {"origin": f"https://127.0.0.1:{PORT}"},
        {"cookie": ""},
        {"cookie": f"guideload-{PORT}=another"},
        {"cookie": f"guideload-{PORT + 1}={TOKEN}"},
    ],
)
def test_others_are_refused(changed: dict[str, str]) -> None:
    assert asked(OWN | changed)[0]["status"] == 403
    assert asked(OWN | changed, kind="websocket") == [{"type": "websocket.close", "code": 1008}]


def test_the_link_becomes_a_cookie_and_its_token_leaves_the_address() -> None:
    first = asked({"host": f"localhost:{PORT}"}, query=f"token={TOKEN}&view=motion")[0]
    headers = {name.decode(): value.decode() for name, value in first["headers"]}
    assert first["status"] == 303 and headers["location"] == "/?view=motion"
    assert headers["set-cookie"] == f"guideload-{PORT}={TOKEN}; HttpOnly; Path=/; SameSite=strict"
    assert asked({"host": OWN["host"]}, query="token=wrong")[0]["status"] == 403


def test_the_link_leads_to_no_other_host() -> None:
    headers = dict(asked(OWN, query=f"token={TOKEN}", path="//evil.example/x")[0]["headers"])
    assert headers[b"location"] == b"/evil.example/x"


@pytest.mark.parametrize(
    "headers",
    [{"content-length": str(LARGEST_BODY + 1)}, {"content-length": "-1"}, {"transfer-encoding": "chunked"}],
)
def test_a_body_without_a_bound_is_refused_before_it_is_read(headers: dict[str, str]) -> None:
    assert asked(OWN | headers)[0]["status"] == 413
    assert asked(OWN | {"content-length": str(LARGEST_BODY)}) == [{"type": "passed"}]
