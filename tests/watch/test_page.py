"""The page of a watch: its numbers are the totals, it needs no network, and a browser draws it."""

import http.client
import json
import re
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from watched import samples, text_of, watched

from guideload.base.errors import ArgumentError
from guideload.watch.page import HOST, Page
from guideload.watch.session import Session

BROWSERS = "chromium", "chromium-browser", "google-chrome"
CHROMIUM = next(filter(None, map(shutil.which, BROWSERS)), None)


@pytest.fixture(scope="module")
def session() -> Session:
    return watched(text_of(*samples()), b"a bad line\n")


@pytest.fixture(scope="module")
def page(session: Session) -> Iterator[Page]:
    page = Page(0, session.curves)
    page.status = session.status()
    yield page
    page.close()


def answer(page: Page, path: str, host: str | None = None) -> tuple[int, str, dict[str, str]]:
    """Code, content and headers."""
    connection = http.client.HTTPConnection(HOST, page.port, timeout=30)
    connection.request("GET", path, headers={} if host is None else {"Host": host})
    found = connection.getresponse()
    text = found.read().decode()
    connection.close()
    return found.status, text, dict(found.getheaders())


def test_its_numbers_are_the_totals(page: Page, session: Session) -> None:
    code, text, _ = answer(page, "/status")
    found: dict[str, Any] = json.loads(text)
    totals = session.monitor.totals()
    assert code == 200 and found["status"] == session.status()
    assert [one["limit_exceeded"] for one in found["status"]["carriages"]] == totals["limit_exceeded"]
    assert found["status"]["input"]["samples"] == totals["samples"]
    assert found["points"] == [list(point) for point in session.curves.points()]
    last = found["points"][-1]
    assert json.loads(answer(page, f"/status?since={last[0]}")[1])["points"] == [last]


def test_it_needs_no_network(page: Page) -> None:
    code, text, headers = answer(page, "/")
    assert code == 200 and "default-src 'none'" in headers["Content-Security-Policy"]
    sources = re.findall(r"""(?:src|href)=["']([^"']*)""", text)
    assert all(source.startswith("data:") for source in sources)
    assert "//" not in text.replace("http://www.w3.org/2000/svg", "")


def test_other_names_and_places_are_refused(page: Page) -> None:
    """A page of the internet may not read this one by giving its name the address of this machine."""
    assert answer(page, "/status", "evil.example")[0] == 403
    assert answer(page, "/status", f"localhost:{page.port}")[0] == 200
    assert answer(page, "/../etc/passwd")[0] == 404
    with pytest.raises(ArgumentError, match=f"--page {page.port}: "):
        Page(page.port, page.curves)


def test_a_browser_that_goes_away_is_not_worth_a_word(
    page: Page, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def gone(since: float) -> bytes:
        raise BrokenPipeError

    monkeypatch.setattr(page, "answer", gone)
    with pytest.raises(http.client.RemoteDisconnected):
        answer(page, "/status")
    monkeypatch.undo()
    assert answer(page, "/status")[0] == 200 and capsys.readouterr().err == ""


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium to open the page with")
def test_a_browser_shows_the_loads_and_draws_a_line_per_carriage(
    tmp_path: Path, page: Page, session: Session
) -> None:
    options = ["--headless", "--no-sandbox", "--disable-gpu", "--enable-logging=stderr"]
    command = [str(CHROMIUM), *options, f"--user-data-dir={tmp_path}", "--virtual-time-budget=3000"]
    ended = subprocess.run(
        [*command, "--dump-dom", page.address], capture_output=True, text=True, timeout=120
    )
    assert ended.returncode == 0 and "CONSOLE" not in ended.stderr and "NaN" not in ended.stdout
    assert len(re.findall('<path d="M[^"]+" stroke="[^"]+" class="line"', ended.stdout)) == 4
    status = session.status()
    rows = re.findall(r"<tr[^>]*>((?:<td>[^<]*</td>)+)</tr>", ended.stdout)
    shown = [re.findall("<td>([^<]*)</td>", row) for row in rows]
    assert [row[0] for row in shown] == session.monitor.carriages
    for row, one in zip(shown, status["carriages"], strict=True):
        assert float(row[3]) == pytest.approx(one["largest_resultant_N"], abs=0.05001)
        assert float(row[4]) == pytest.approx(one["time_of_largest_s"], abs=5e-4)
        assert int(row[5]) == one["limit_exceeded"]
    assert f"samples {status['input']['samples']}," in ended.stdout and "malformed 1" in ended.stdout
