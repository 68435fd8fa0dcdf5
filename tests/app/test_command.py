"""The command `guideload app` around the page."""

import socket

import pytest
from command_line import refused


def test_without_the_extra_the_command_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("guideload.cli.app.find_spec", lambda name: None)
    assert 'nicegui is not installed; the page needs: pip install "guideload[app]"' in refused("app")


def test_a_port_in_use_and_a_file_elsewhere_are_refused() -> None:
    pytest.importorskip("nicegui", reason="the extra guideload[app] is not installed")
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        assert f"--port {port}: cannot be used" in refused("app", "--port", port, code=1)
    assert "expected a file below" in refused("app", "/elsewhere/machine.toml", code=1)
