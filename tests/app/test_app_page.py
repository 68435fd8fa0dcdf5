"""The page in a real browser: each view, what goes wrong, two tabs, and a server that is killed."""

import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("nicegui", reason="the extra guideload[app] is not installed")

from app_folder import PRODUCTS, write_project
from browser import browser, served, until
from watched import new_monitor, samples, text_of, write_monitor

import guideload
from guideload.app.document import with_values

LOAD = ".figure .value"  # the first figure is the largest load


@pytest.fixture(scope="module")
def driver() -> Iterator[Any]:
    with browser() as found:
        yield found


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write_project(tmp_path)


@pytest.fixture
def page(driver: Any, folder: Path) -> Iterator[Any]:
    """The driver with the page of `folder` open, and its first answer on it."""
    with served(folder) as server:
        driver.get(server.link)
        load(driver)
        yield driver


def text(driver: Any, selector: str) -> str:
    return str(
        driver.execute_script("return document.querySelector(arguments[0])?.innerText ?? ''", selector)
    )


def load(driver: Any) -> str:
    """The largest load on the page, once it is computed."""
    return until(lambda: (shown := text(driver, LOAD)).endswith(" N") and shown, "the largest load")


def changed(driver: Any, before: str) -> str:
    return until(lambda: (now := load(driver)) != before and now, f"another load than {before}")


def field(driver: Any, name: str) -> Any:
    """The input of a key, as in machine-body-mass."""
    return until(lambda: driver.find_element("id", name), name)


def fill(driver: Any, name: str, value: str) -> None:
    """Type a value into a field, as a user of the keyboard."""
    keys = pytest.importorskip("selenium.webdriver").Keys
    box = field(driver, name)
    driver.execute_script("arguments[0].scrollIntoView({block: 'center'})", box)
    box.send_keys(keys.CONTROL, "a")
    box.send_keys(value, keys.TAB)


def press(driver: Any, words: str) -> None:
    """Click the button with these words or this label."""
    path = f"//button[normalize-space(.)='{words}' or .//span[normalize-space(.)='{words}'] or @aria-label='{words}']"
    until(lambda: (driver.find_element("xpath", path).click(), True)[1], f"button {words}")


def unfolded(driver: Any, title: str) -> bool:
    """Whether the part with this title is unfolded; if not, its header is clicked, wherever others push it."""
    item = "//div[contains(@class, 'q-expansion-item')]"
    header = driver.find_element("xpath", f"{item}//div[@role='button'][contains(., '{title}: ')]")
    item = header.find_element("xpath", "ancestor::div[contains(@class, 'q-expansion-item ')][1]")
    if "q-expansion-item--expanded" in item.get_attribute("class"):
        return True
    driver.execute_script("arguments[0].click()", header)
    return False


def unfold(driver: Any, section: str) -> None:
    """Unfold a section of the form."""
    label = f"//div[contains(@class, 'q-item__label')][normalize-space(.)='{section}']"
    path = f"{label}/ancestor::div[contains(@class, 'q-item ')][1]"
    driver.execute_script("arguments[0].click()", until(lambda: driver.find_element("xpath", path), section))


def opened(driver: Any, view: str) -> None:
    path = f"//div[@role='tab'][contains(., '{view}')]"
    until(lambda: (driver.find_element("xpath", path).click(), True)[1], f"view {view}")


def saved(folder: Path, before: guideload.Machine) -> guideload.Machine:
    """The machine in the file, once it is another one than before."""
    return until(
        lambda: (now := guideload.Machine.from_toml(folder / "machine.toml")) != before and now,
        "a saved file",
    )


def of_library(folder: Path) -> guideload.Result:
    """What the library computes of the files in the folder."""
    machine = guideload.Machine.from_toml(folder / "machine.toml")
    return guideload.simulate(machine, guideload.Moves.from_toml(folder / "moves.toml").motion())


def drag(driver: Any, part: str, right: int, steps: int = 8) -> None:
    """Drag a part of the scene by its name to the right of the screen [px]."""
    where = until(
        lambda: driver.execute_script(
            """
            const host = document.querySelector('.scene'), scene = getElement(+host.id.slice(1));
            const part = scene.draggable_objects.find((one) => one.name === arguments[0]);
            if (!part.position.length()) return null;  // not in its place yet
            scene.camera.updateMatrixWorld();
            const at = part.position.clone().project(scene.camera), box = host.getBoundingClientRect();
            return [box.left + (at.x + 1) / 2 * box.width, box.top + (1 - at.y) / 2 * box.height];
            """,
            part,
        ),
        part,
    )
    chains = pytest.importorskip("selenium.webdriver").ActionChains(driver, duration=30)
    chains.w3c_actions.pointer_action.move_to_location(*map(round, where))
    chains.w3c_actions.pointer_action.pointer_down()
    for n in range(1, steps + 1):
        chains.w3c_actions.pointer_action.move_to_location(
            round(where[0] + right * n / steps), round(where[1])
        )
    chains.w3c_actions.pointer_action.pointer_up()
    chains.perform()


def test_nothing_is_asked_of_another_host(driver: Any, folder: Path) -> None:
    """All that the page needs comes with the package."""
    with served(folder) as server:
        driver.get_log("performance")
        driver.get(server.link)
        load(driver)
        asked = [
            entry["message"]
            for entry in driver.get_log("performance")
            if 'requestWillBeSent"' in entry["message"]
        ]
        port = server.link.split(":")[2].split("/")[0]
        hosts = set(re.findall(r'"request":\{[^}]*?"url":"(?:https?|wss?)://([^/"]+)', "\n".join(asked)))
        assert asked and hosts <= {f"127.0.0.1:{port}"}


def test_a_value_that_is_typed_changes_the_answer_and_undo_brings_it_back(page: Any, folder: Path) -> None:
    before = load(page)
    fill(page, "machine-body-mass", "2500")
    after = changed(page, before)
    assert field(page, "machine-body-mass").get_attribute("value") == "2500 kg"
    machine = guideload.Machine.from_text(
        (folder / "machine.toml").read_text().replace('"1250 kg"', '"2500 kg"')
    )
    motion = guideload.Moves.from_toml(folder / "moves.toml").motion()
    peak = guideload.simulate(machine, motion).peaks()["peak_resultant_N"].max()
    assert float(after.removesuffix(" N").replace("\u202f", "")) == pytest.approx(peak, abs=0.5)
    press(page, "Undo")
    assert changed(page, after) == before


def test_a_product_is_offered_by_its_name_and_by_maker_and_size(page: Any) -> None:
    options = "return [...arguments[0].list.options].map((one) => [one.value, one.label]);"
    shown = dict(page.execute_script(options, field(page, "machine-carriages-0-product")))
    assert list(shown) == [one.name for one in guideload.packaged_catalogue().products]
    assert shown["HGH25CA"] == "HIWIN 25 HGH25CA"


def test_a_field_that_was_empty_leaves_the_keyboard_in_the_next_one(driver: Any, folder: Path) -> None:
    keys = pytest.importorskip("selenium.webdriver").Keys
    file = folder / "machine.toml"
    file.write_text(guideload.file_template("vertical"))
    before = guideload.Machine.from_toml(file)
    with served(folder) as server:
        driver.get(server.link)
        load(driver)
        unfold(driver, "report")
        until(lambda: field(driver, "machine-report-date").is_displayed(), "the fields of the report")
        fill(driver, "machine-report-project", "Lift 7")
        kept = folder / ".guideload-app.json"
        until(lambda: "Lift 7" in kept.read_text(), "the project in the state")
        for text in ("ACME", "A. Designer"):
            driver.switch_to.active_element.send_keys(text, keys.TAB)
        press(driver, "Save")
        now = saved(folder, before)
        assert (now.name, now.report.customer, now.report.author) == ("Vertical axis", "ACME", "A. Designer")


def test_a_wrong_value_is_refused_beside_its_field_and_the_answer_stays(page: Any) -> None:
    before = load(page)
    fill(page, "machine-body-mass", "12 kN")
    message = until(lambda: text(page, ".q-field--error .q-field__messages"), "the reason")
    assert 'body.mass: expected a mass in kg, got "12 kN"' in message
    assert load(page) == before and "the last state" in text(page, ".verdict")
    fill(page, "machine-body-mass", "1300 kg")
    changed(page, before)
    assert not text(page, ".q-field--error .q-field__messages")


def test_a_carriage_is_dragged_along_its_rail(page: Any, folder: Path) -> None:
    start = guideload.Machine.from_toml(folder / "machine.toml")
    before = load(page)
    drag(page, "carriage 1", 40)
    changed(page, before)
    press(page, "Save")
    now = saved(folder, start)
    moved = [a.x != b.x for a, b in zip(start.carriages, now.carriages, strict=True)]
    assert moved == [False, True, False, False] and now.body == start.body
    press(page, "Undo")
    until(lambda: load(page) == before, "one step of undo for the whole drag")


def test_the_keyboard_moves_the_centre_of_mass(page: Any) -> None:
    keys = pytest.importorskip("selenium.webdriver").Keys
    before = load(page)
    until(lambda: page.find_element("xpath", "//button[normalize-space(.)='z +']")).send_keys(keys.ENTER)
    changed(page, before)
    assert "100 mm" in field(page, "machine-body-center_of_mass").get_attribute("value")


def test_the_wheel_zooms_the_picture_with_ctrl_only(page: Any) -> None:
    turned = """
        const scene = getElement(+document.querySelector('.scene').id.slice(1));
        const distance = () => scene.camera.position.distanceTo(scene.controls.target), before = distance();
        const turn = new WheelEvent("wheel", {deltaY: 100, ctrlKey: arguments[0], bubbles: true, cancelable: true});
        scene.$el.querySelector("canvas").dispatchEvent(turn);
        scene.controls.update();
        return [turn.defaultPrevented, distance() > 1.01 * before];
    """
    until(lambda: page.execute_script(turned, True) == [True, True], "a picture that is zoomed")
    until(lambda: page.execute_script(turned, False) == [False, False], "a page that scrolls")


def give(driver: Any, file: Path) -> None:
    """Give a file to the page, as by dropping it on the field."""
    opened(driver, "Motion")
    press(driver, "measured trace")
    until(lambda: driver.find_element("css selector", "input[type=file]")).send_keys(str(file))


def test_a_trace_is_dropped_and_its_inspection_shown(page: Any, folder: Path, tmp_path_factory: Any) -> None:
    outside = tmp_path_factory.mktemp("outside") / "measured.csv"
    outside.write_text(guideload.file_template("trace"))
    before = load(page)
    give(page, outside)
    changed(page, before)
    until(lambda: "measured.csv, column motor_speed_rpm" in text(page, "main"), "the inspection")
    assert (folder / "measured.csv").read_bytes() == outside.read_bytes()
    press(page, "planned moves")
    until(lambda: load(page) == before, "the load under the planned moves")


def test_a_broken_trace_is_refused_in_words_and_the_moves_are_run_again(
    page: Any, folder: Path, tmp_path_factory: Any
) -> None:
    broken = tmp_path_factory.mktemp("outside") / "broken.csv"
    broken.write_text("time [s],speed [m/s]\n0,0\n0.001,abc\n")
    before = load(page)
    give(page, broken)
    message = until(
        lambda: (found := text(page, ".verdict")) and "broken.csv" in found and found, "the reason"
    )
    with pytest.raises(guideload.TraceError) as refused:
        guideload.read_trace(broken)
    assert str(refused.value).partition("broken.csv")[2][:40] in message
    press(page, "planned moves")
    until(lambda: "last state" not in text(page, ".verdict") and load(page) == before, "the moves")


def test_a_product_is_taken_from_the_table(page: Any, folder: Path) -> None:
    start = guideload.Machine.from_toml(folder / "machine.toml")
    before = load(page)
    opened(page, "Decide")
    field = until(lambda: page.find_element("xpath", "//input[@aria-label='products, e.g. HIWIN 25']"))
    field.send_keys(pytest.importorskip("selenium.webdriver").Keys.CONTROL, "a")
    field.send_keys("HIWIN 25")
    press(page, "Size")
    row = until(lambda: page.find_element("xpath", "//td[contains(., 'HGH25CA')]"), "a row of the table")
    page.execute_script("arguments[0].scrollIntoView({block: 'center'})", row)
    until(lambda: (row.click(), True)[1])
    changed(page, before)
    until(lambda: "Static safety" in text(page, ".figures"), "the static safety")
    press(page, "Save")
    products = saved(folder, start).product_of_carriage
    assert {one.name for one in products if one} == {"HGH25CA"}


def test_the_report_is_written_as_the_command_line_writes_it(page: Any, folder: Path) -> None:
    opened(page, "Keep")
    press(page, "Write the report")
    written = until(lambda: (folder / "report.html").read_text(), "a report")
    assert written == guideload.html_report.run_page(of_library(folder))


def test_two_tabs_show_one_machine(driver: Any, folder: Path) -> None:
    with served(folder) as server:
        driver.get(server.link)
        before, first = load(driver), driver.current_window_handle
        driver.switch_to.new_window("tab")
        try:
            driver.get(server.link)
            load(driver)
            fill(driver, "machine-body-mass", "2000 kg")
            after = changed(driver, before)
            driver.switch_to.window(first)
            until(lambda: load(driver) == after, "the load in the other tab")
            assert field(driver, "machine-body-mass").get_attribute("value") == "2000 kg"
        finally:
            for other in set(driver.window_handles) - {first}:
                driver.switch_to.window(other)
                driver.close()
            driver.switch_to.window(first)


def test_nothing_is_lost_when_the_server_is_killed(driver: Any, folder: Path) -> None:
    file = (folder / "machine.toml").read_text()
    with served(folder) as server:
        driver.get(server.link)
        before = load(driver)
        fill(driver, "machine-body-mass", "2000 kg")
        after = changed(driver, before)
        server.end()
    assert (folder / "machine.toml").read_text() == file
    with served(folder) as server:
        driver.get(server.link)
        assert load(driver) == before
        press(driver, "Take them")
        until(lambda: load(driver) == after, "the load of the changes that were found")
        press(driver, "Save")
        until(lambda: '"2000 kg"' in (folder / "machine.toml").read_text(), "a saved file")


def test_a_file_that_another_program_changes_is_read_again(page: Any, folder: Path) -> None:
    before = load(page)
    file = folder / "machine.toml"
    file.write_text(file.read_text().replace('"1250 kg"', '"1900 kg"'))
    changed(page, before)
    assert field(page, "machine-body-mass").get_attribute("value") == "1900 kg"


# Text whose contrast with its background is below 4.5 (WCAG AA); disabled parts are exempt.
PALE = """
const channel = (c) => (c /= 255) <= 0.03928 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4;
const light = (c) => 0.2126 * channel(c[0]) + 0.7152 * channel(c[1]) + 0.0722 * channel(c[2]);
const numbers = (text) => (text.match(/[\\d.]+/g) || []).map(Number);
const found = [], walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
while (walker.nextNode()) {
  const element = walker.currentNode.parentElement, style = getComputedStyle(element);
  const seen = element.checkVisibility({checkOpacity: true, checkVisibilityCSS: true});
  if (!walker.currentNode.data.trim() || !seen) continue;
  if (element.closest('.disabled, [disabled], .q-notification, script, style')) continue;
  const layers = [];
  for (let one = element; one; one = one.parentElement) layers.unshift(numbers(getComputedStyle(one).backgroundColor));
  const mixed = (under, [r, g, b, part = 1]) => [r, g, b].map((c, i) => part * c + (1 - part) * under[i]);
  const back = layers.filter((one) => one.length).reduce(mixed, [255, 255, 255]);
  const a = light(numbers(style.color)), b = light(back);
  const ratio = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
  if (ratio < 4.5) found.push([walker.currentNode.data.trim().slice(0, 40), style.color, ratio.toFixed(2)]);
}
return found;
"""
CONTROLS = {"button", "textbox", "combobox", "checkbox", "slider", "tab", "spinbutton", "radio", "switch"}


def test_every_control_has_a_name_and_every_text_its_contrast(page: Any) -> None:
    shown = ""
    for view in ("Machine", "Motion", "Decide", "Keep", "Monitor"):
        opened(page, view)
        shown = until(lambda last=shown: (now := text(page, "[role=tabpanel]")) != last and now, view)
        nodes = page.execute_cdp_cmd("Accessibility.getFullAXTree", {})["nodes"]
        controls = [
            one for one in nodes if one.get("role", {}).get("value") in CONTROLS and not one.get("ignored")
        ]
        nameless = [one["role"]["value"] for one in controls if not one.get("name", {}).get("value")]
        assert len(controls) > 5 and not nameless, (view, nameless)
        pale = page.execute_script(PALE)
        assert not pale, (view, pale)


def test_the_chart_keeps_the_peak_at_every_zoom(page: Any, folder: Path) -> None:
    drawn = """
        const chart = getElement(+document.querySelector('.answer .history').id.slice(1)).chart;
        return chart.getOption().series.map((one) => one.data);
    """
    result = of_library(folder)
    time, loads = result.quantities["time"], result.quantities["resultant"]
    until(lambda: len(page.execute_script(drawn)) == 4, "the histories")
    page.execute_script(
        "getElement(+document.querySelector('.answer .history').id.slice(1)).chart"
        ".dispatchAction({type: 'dataZoom', start: 0, end: 2})"
    )
    inside = time <= time[0] + 0.02 * (time[-1] - time[0])

    def fine() -> bool:
        """The stretch in view has all its samples, and the whole its peaks."""
        lines = [np.array(line) for line in page.execute_script(drawn)]
        return all(
            (line[:, 0] <= time[inside][-1] + 1e-6).sum() == inside.sum()
            and np.isclose(line[:, 1].max(), loads[:, i].max(), rtol=1e-4)
            for i, line in enumerate(lines)
        )

    until(fine, "a finer stretch with all peaks")


def test_limit_drivers_study_and_variants_say_what_the_library_says(driver: Any, folder: Path) -> None:
    file = folder / "machine.toml"
    file.write_text(with_values(file.read_text(), PRODUCTS | {("life", "life"): "10000 h"}))
    machine = guideload.Machine.from_toml(file)
    motion = guideload.Moves.from_toml(folder / "moves.toml").motion()
    with served(folder) as server:
        driver.get(server.link)
        load(driver)
        opened(driver, "Decide")
        for title in ("Limit", "Drivers", "Study", "Variants"):
            until(lambda title=title: unfolded(driver, title), title)
        press(driver, "Find the limit")
        found = guideload.sizing.largest(machine, motion, "pace")
        first = guideload.reports.limit_report(machine, found, machine.life).answer[0]
        until(lambda: first in text(driver, ".views"), first)
        press(driver, "Find the drivers")
        until(
            lambda: "sensitivities machine.toml moves.toml --of peak_resultant" in text(driver, ".views"),
            "drivers",
        )
        press(driver, "Run the study")
        until(lambda: "1000 of 1000 machines" in text(driver, ".views"), "all machines")
        until(lambda: "Peak resultant, 99 % quantile" in text(driver, ".views"), "the report of the study")
        press(driver, "Keep this machine as A")
        press(driver, "Compare A with now")
        until(lambda: "The machines are the same" in text(driver, ".views"), "the comparison")


def test_a_mode_swings_the_body_as_its_shape_says(page: Any, folder: Path) -> None:
    """The ghost turns and moves about the origin, both in proportion to the shape."""
    place = """
        const scene = getElement(+document.querySelector('.scene').id.slice(1));
        const ghost = [...scene.objects.values()].map((one) => one.mesh).find((one) => one?.name === 'ghost');
        const {x, y, z, w} = ghost.quaternion;
        return ghost.visible ? [...ghost.position.toArray(), 2 * x / w, 2 * y / w, 2 * z / w] : null;
    """
    path = "//label[contains(., 'mode (damping)')]"
    shapes = guideload.Modes.of(guideload.Machine.from_toml(folder / "machine.toml")).shape
    for number in (0, 3):
        until(lambda: (page.find_element("xpath", path).click(), True)[1], "the list of modes")
        option = f"(//div[@role='option'])[{number + 2}]"  # the first is none
        until(lambda option=option: (page.find_element("xpath", option).click(), True)[1], option)

        def swings(shape: Any = shapes[number]) -> bool:
            seen = np.array(page.execute_script(place))
            along = float(seen @ shape) / float(np.linalg.norm(seen) * np.linalg.norm(shape))
            return bool(np.linalg.norm(seen) > 1e-4) and abs(abs(along) - 1.0) < 1e-9

        until(swings, f"mode {number}")


def test_the_report_draws_where_the_life_is_used(driver: Any, folder: Path) -> None:
    file = folder / "machine.toml"
    file.write_text(with_values(file.read_text(), PRODUCTS))
    places = guideload.life_of(of_library(folder)).places
    total = sum(one.damage.sum() for one in places)
    drawn = """
        const charts = [...document.querySelectorAll('.answer .history')];
        return getElement(+charts[1].id.slice(1)).chart.getOption().series.map((one) => one.data);
    """
    with served(folder) as server:
        driver.get(server.link)
        load(driver)
        path = "//div[@role='button'][contains(., 'Report: causes')]"
        until(lambda: (driver.find_element("xpath", path).click(), True)[1], "the report")
        lines = until(lambda: driver.execute_script(drawn), "the chart of life by place")
        for one, line in zip(places, lines, strict=True):
            assert max(y for _, y in line) == pytest.approx(100.0 * one.density.max() / total, rel=1e-4)


def test_a_watch_is_seen_live_and_its_end_is_told(page: Any, folder: Path) -> None:
    """What `guideload monitor watch -o` writes is on the page while samples come in."""
    stamps, counts = samples()
    words = ["monitor", "watch", str(write_monitor(folder)), "-o", "loads"]
    command = [sys.executable, "-m", "guideload", *words]
    opened(page, "Monitor")
    until(lambda: "No watch has written" in text(page, ".views"), "that there is no watch")
    watch = subprocess.Popen(command, cwd=folder, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL)
    try:
        assert watch.stdin is not None
        watch.stdin.write(text_of(stamps[:3000], counts[:3000]))
        watch.stdin.flush()
        until(lambda: "3000 samples: all good" in text(page, ".views"), "the samples that came in")
        assert "live: " in text(page, ".views")
        watch.stdin.write(text_of(stamps[3000:], counts[3000:]))
        watch.stdin.close()
        assert watch.wait() == 0
    finally:
        watch.kill()
        watch.wait()
    until(lambda: "ended " in text(page, ".views"), "the end of the watch")
    monitor = new_monitor()
    monitor.push(stamps, counts)
    largest = max(one[5] for one in monitor.totals()["largest"]) ** 0.5
    until(lambda: f"{stamps.size} samples: all good" in text(page, ".views"), "all samples")
    assert f"the largest resultant so far is {largest:.0f} N" in text(page, ".views")
    drawn = (
        "return getElement(+[...document.querySelectorAll('.views .history')].at(-1).id.slice(1))"
        ".chart.getOption().series.map((one) => one.data)"
    )
    lines = page.execute_script(drawn)
    assert len(lines) == 4
    state = guideload.WatchState.read(folder / "loads")
    shown = [[line[i][1] for line in lines] for i in range(len(state.points))]
    assert shown == [point[1:] for point in state.points]
