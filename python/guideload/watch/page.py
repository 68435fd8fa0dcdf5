"""A page on this machine that shows a watch, with live curves; it needs no network and no files but its own text."""

from __future__ import annotations

import os
import sys
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from typing import Any
from urllib.parse import parse_qs, urlsplit

from guideload.base.errors import ArgumentError
from guideload.base.finite import finite_json
from guideload.watch.status import Curves

HOST = "127.0.0.1"
POLICY = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; connect-src 'self'; img-src data:"


class Page:
    """A server of the page on a port of this machine, in a thread of its own. port 0: any free one."""

    def __init__(self, port: int, curves: Curves) -> None:
        self.curves = curves
        self.status: dict[str, Any] | None = None
        text = (files(__package__) / "page.html").read_bytes()
        try:
            self._server = _Server((HOST, port), _Handler)
        except (OSError, OverflowError) as error:
            raise ArgumentError(f"--page {port}: {getattr(error, 'strerror', None) or error}") from None
        self._server.text, self._server.page = text, self
        self.port = int(self._server.server_address[1])
        self._thread = threading.Thread(target=self._server.serve_forever, args=(0.1,), daemon=True)
        self._thread.start()

    @property
    def address(self) -> str:
        """The address for a browser."""
        return f"http://{HOST}:{self.port}/"

    def answer(self, since: float) -> bytes:
        """The state, and the points of the curves from an instant on [s], as JSON."""
        answer = {"status": self.status, "points": self.curves.points(since)}
        return finite_json(answer).encode("ascii")

    def close(self) -> None:
        """End the server."""
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()


class _Server(ThreadingHTTPServer):
    daemon_threads = True
    allow_reuse_address = os.name == "posix"  # elsewhere a second program could take the same port
    text: bytes
    page: Page

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Say nothing of a browser that went away before its answer was there."""
        if not isinstance(sys.exc_info()[1], ConnectionError):
            super().handle_error(request, client_address)


class _Handler(BaseHTTPRequestHandler):
    """Answers `/` with the page and `/status?since=TIME` with numbers."""

    server: _Server
    timeout = 10.0  # s to wait for the request of a browser

    def do_GET(self) -> None:
        asked, page = urlsplit(self.path), self.server.page
        # Another name is that of a page of the internet whose name server gives our address (DNS rebinding).
        if self.headers.get("Host") not in (f"{HOST}:{page.port}", f"localhost:{page.port}"):
            self.send_error(403)
        elif asked.path == "/":
            self._send(self.server.text, "text/html; charset=utf-8")
        elif asked.path == "/status":
            try:
                since = float(parse_qs(asked.query).get("since", ["-1"])[0])
            except ValueError:
                since = -1.0
            self._send(page.answer(since), "application/json")
        else:
            self.send_error(404)

    def _send(self, content: bytes, kind: str) -> None:
        self.send_response(200)
        for name, value in (
            ("Content-Type", kind),
            ("Content-Length", str(len(content))),
            ("Content-Security-Policy", POLICY),
            ("X-Content-Type-Options", "nosniff"),
            ("Cache-Control", "no-store"),
        ):
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(content)

    def log_message(self, format: str, *args: Any) -> None:
        """Say nothing: standard error is for the watch."""
