"""The pictures of the how-to page on `guideload app`: it walks through the page in headless Chromium.

python docs/app_pictures.py
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "tests" / "helpers"), str(ROOT / "tests" / "app")]

from browser import browser, served, until  # noqa: E402
from test_app_page import changed, fill, load, opened, press, text  # noqa: E402
from watched import samples, text_of, write_monitor  # noqa: E402

IMAGES = ROOT / "docs" / "images"
REST = 1.5  # s until the page is judged and drawn


def take(driver: Any, name: str) -> None:
    """A picture of the page at rest."""
    time.sleep(REST)
    driver.save_screenshot(str(IMAGES / f"app-{name}.png"))


def choose(driver: Any, label: str, words: str) -> None:
    """Choose from a list by its label."""
    until(lambda: (driver.find_element("xpath", f"//label[contains(., '{label}')]").click(), True)[1], label)
    path = f"//div[@role='option'][contains(., '{words}')]"
    until(lambda: (driver.find_element("xpath", path).click(), True)[1], words)


def take_monitor(driver: Any, folder: Path) -> None:
    """A picture of a watch that takes 60 s of samples."""
    write_monitor(folder)
    stamps, counts = samples(60_000)
    words = [sys.executable, "-m", "guideload", "monitor", "watch", "monitor.toml", "-o", "loads"]
    with subprocess.Popen(words, cwd=folder, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL) as watch:
        assert watch.stdin is not None
        watch.stdin.write(text_of(stamps, counts))
        watch.stdin.flush()
        opened(driver, "Monitor")
        until(lambda: f"{stamps.size} samples" in text(driver, ".views"), "the samples")
        take(driver, "monitor")
        watch.stdin.close()


def main() -> None:
    """From nothing to the report of a vertical axis."""
    with tempfile.TemporaryDirectory() as name, served(Path(name)) as server, browser() as driver:
        driver.get(server.link)
        before = load(driver)
        choose(driver, "start from", "vertical axis")
        before = changed(driver, before)
        fill(driver, "machine-body-mass", "60 kg")
        before = changed(driver, before)
        until(
            lambda: (
                driver.find_element("xpath", "//div[@role='button'][contains(., 'life')]").click(),
                True,
            )[1]
        )
        fill(driver, "machine-life-life", "5000 h")
        driver.execute_script("document.querySelector('.views').scrollTop = 0")
        take(driver, "machine")
        fill(driver, "machine-body-mass", "60 lbf")
        until(lambda: text(driver, ".q-field--error .q-field__messages"), "the reason")
        take(driver, "error")
        fill(driver, "machine-body-mass", "60 kg")
        opened(driver, "Motion")
        fill(driver, "moves-moves-0-distance", "800 mm")
        driver.execute_script("document.querySelector('.views').scrollTop = 0")
        take(driver, "motion")
        opened(driver, "Decide")
        press(driver, "Size")
        until(lambda: "Click a row" in text(driver, ".views"), "the sizes")
        take(driver, "size")
        press(driver, "Take")
        until(lambda: "Static safety" in text(driver, ".figures"), "the static safety")
        opened(driver, "Keep")
        press(driver, "Write the report")
        until(lambda: "Wrote report.html" in text(driver, ".views"), "the report")
        press(driver, "Save")
        take(driver, "keep")
        take_monitor(driver, Path(name))


if __name__ == "__main__":
    main()
