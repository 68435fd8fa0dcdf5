"""The server of the page, for this computer's own browser."""

from __future__ import annotations

import secrets
import socket
from pathlib import Path

from nicegui import app, ui

import guideload
from guideload.app.files import Folder
from guideload.app.guard import Guard
from guideload.app.hub import Hub
from guideload.app.page import Page
from guideload.app.state import Session

HOST = "127.0.0.1"
LOOK = 1.0  # s between two looks at the files


def serve(root: Path, machine_file: Path, motion_file: Path | None, port: int, browser: bool) -> None:
    """Serve the page until Ctrl-C.

    Parameters
    ----------
    root
        The folder below which files are read and written.
    machine_file
        The machine file, which need not exist yet.
    motion_file
        A motion file, which need not exist yet, or a trace; None: moves.toml beside the machine file.
    port
        Of the page; 0: a free one.
    browser
        Whether the link is opened in the browser; it is printed in any case.

    Raises
    ------
    GuideloadError
        For a machine file outside the folder or that is no text, and for a port in use.
    """
    folder = Folder(root)
    machine_name = folder.name(machine_file)
    motion_name = folder.name(motion_file or machine_file.parent / "moves.toml")
    session = Session(folder, machine_name, motion_name)
    port, token = free_port(port), secrets.token_urlsafe(18)
    hub = Hub(session)
    app.add_middleware(Guard, port=port, token=token)
    app.on_startup(hub.start)
    app.timer(LOOK, hub.look)
    link = f"http://{HOST}:{port}/?token={token}"
    print(f"The page of {machine_name}: {link}\nCtrl-C ends it.", flush=True)
    ui.run(
        lambda: Page(hub).build(),
        host=HOST,
        port=port,
        title=f"{machine_name} - guideload",
        language="en-US",
        reload=False,
        show=f"/?token={token}" if browser else False,
        show_welcome_message=False,
        gzip_middleware_factory=None,  # nothing leaves this computer
        reconnect_timeout=20.0,
    )


def free_port(wanted: int) -> int:
    """The port, if it is free, or for 0 any free one. Raises GuideloadError."""
    with socket.socket() as probe:
        try:
            probe.bind((HOST, wanted))
        except OSError as error:
            raise guideload.GuideloadError(
                f"--port {wanted}: cannot be used ({error.strerror}); leave it out for a free one"
            ) from None
        return int(probe.getsockname()[1])
