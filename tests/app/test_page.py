"""The page in a real browser: each view, what goes wrong, two tabs, and a server that is killed."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("nicegui", reason="the extra guideload[app] is not installed")

from browser import browser, served, until

import guideload

pytestmark = pytest.mark.slow
LOAD = ".figure .value"  # the first figure is the largest load


@pytest.fixture(scope="module")
def driver() -> Iterator[Any]:
    with browser() as found:
        yield found


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "machine.toml").write_text(guideload.file_template("manipulator"))
    (tmp_path / "moves.toml").write_text(guideload.file_template("moves").replace("repeat = 2", "repeat = 1"))
    return tmp_path


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


def opened(driver: Any, view: str) -> None:
    path = f"//div[@role='tab'][contains(., '{view}')]"
    until(lambda: (driver.find_element("xpath", path).click(), True)[1], f"view {view}")


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


def test_a_value_that_is_typed_changes_the_answer_and_undo_brings_it_back(driver: Any, folder: Path) -> None:
    with served(folder) as server:
        driver.get(server.link)
        before = load(driver)
        fill(driver, "machine-body-mass", "2500 kg")
        after = changed(driver, before)
        machine = guideload.Machine.from_text(
            (folder / "machine.toml").read_text().replace('"1250 kg"', '"2500 kg"')
        )
        motion = guideload.Moves.from_toml(folder / "moves.toml").motion()
        peak = guideload.simulate(machine, motion).peaks()["peak_resultant_N"].max()
        assert float(after.removesuffix(" N").replace("\u202f", "")) == pytest.approx(peak, abs=0.5)
        press(driver, "Undo")
        assert changed(driver, after) == before


def test_a_wrong_value_is_refused_beside_its_field_and_the_answer_stays(driver: Any, folder: Path) -> None:
    with served(folder) as server:
        driver.get(server.link)
        before = load(driver)
        fill(driver, "machine-body-mass", "12 kN")
        message = until(lambda: text(driver, ".q-field--error .q-field__messages"), "the reason")
        assert 'body.mass: expected a mass in kg, got "12 kN"' in message
        assert load(driver) == before and "the last state" in text(driver, ".verdict")
        fill(driver, "machine-body-mass", "1300 kg")
        changed(driver, before)
        assert not text(driver, ".q-field--error .q-field__messages")


def test_a_carriage_is_dragged_along_its_rail(driver: Any, folder: Path) -> None:
    with served(folder) as server:
        driver.get(server.link)
        before = load(driver)
        drag(driver, "carriage 1", 40)
        changed(driver, before)
        press(driver, "Save")
        start = guideload.Machine.from_text(guideload.file_template("manipulator"))
        saved = until(
            lambda: (m := guideload.Machine.from_toml(folder / "machine.toml")) != start and m, "a saved file"
        )
        moved = [a.x != b.x for a, b in zip(start.carriages, saved.carriages, strict=True)]
        assert moved == [False, True, False, False] and saved.body == start.body
        press(driver, "Undo")
        until(lambda: load(driver) == before, "one step of undo for the whole drag")


def test_the_keyboard_moves_the_centre_of_mass(driver: Any, folder: Path) -> None:
    keys = pytest.importorskip("selenium.webdriver").Keys
    with served(folder) as server:
        driver.get(server.link)
        before = load(driver)
        until(lambda: driver.find_element("xpath", "//button[normalize-space(.)='z +']")).send_keys(
            keys.ENTER
        )
        changed(driver, before)
        assert "100 mm" in field(driver, "machine-body-center_of_mass").get_attribute("value")


def give(driver: Any, file: Path) -> None:
    """Give a file to the page, as by dropping it on the field."""
    opened(driver, "Motion")
    press(driver, "measured trace")
    until(lambda: driver.find_element("css selector", "input[type=file]")).send_keys(str(file))


def test_a_trace_is_dropped_and_its_inspection_shown(
    driver: Any, folder: Path, tmp_path_factory: Any
) -> None:
    outside = tmp_path_factory.mktemp("outside") / "measured.csv"
    outside.write_text(guideload.file_template("trace"))
    with served(folder) as server:
        driver.get(server.link)
        before = load(driver)
        give(driver, outside)
        changed(driver, before)
        until(lambda: "measured.csv, column motor_speed_rpm" in text(driver, "main"), "the inspection")
        assert (folder / "measured.csv").read_bytes() == outside.read_bytes()
        press(driver, "planned moves")
        until(lambda: load(driver) == before, "the load under the planned moves")


def test_a_broken_trace_is_refused_in_words_and_the_moves_are_run_again(
    driver: Any, folder: Path, tmp_path_factory: Any
) -> None:
    broken = tmp_path_factory.mktemp("outside") / "broken.csv"
    broken.write_text("time [s],speed [m/s]\n0,0\n0.001,abc\n")
    with served(folder) as server:
        driver.get(server.link)
        before = load(driver)
        give(driver, broken)
        message = until(
            lambda: (found := text(driver, ".verdict")) and "broken.csv" in found and found, "the reason"
        )
        with pytest.raises(guideload.TraceError) as refused:
            guideload.read_trace(broken)
        assert str(refused.value).partition("broken.csv")[2][:40] in message
        press(driver, "planned moves")
        until(lambda: "last state" not in text(driver, ".verdict") and load(driver) == before, "the moves")


def test_a_product_is_taken_from_the_table(driver: Any, folder: Path) -> None:
    with served(folder) as server:
        driver.get(server.link)
        before = load(driver)
        opened(driver, "Decide")
        field = until(lambda: driver.find_element("xpath", "//input[@aria-label='products, e.g. HIWIN 25']"))
        field.send_keys(pytest.importorskip("selenium.webdriver").Keys.CONTROL, "a")
        field.send_keys("HIWIN 25")
        press(driver, "Size")
        row = until(
            lambda: driver.find_element("xpath", "//td[contains(., 'HGH25CA')]"), "a row of the table"
        )
        driver.execute_script("arguments[0].scrollIntoView({block: 'center'})", row)
        until(lambda: (row.click(), True)[1])
        changed(driver, before)
        until(lambda: "Static safety" in text(driver, ".figures"), "the static safety")
        press(driver, "Save")
        saved = until(
            lambda: any((m := guideload.Machine.from_toml(folder / "machine.toml")).product_of_carriage) and m
        )
        assert {one.name for one in saved.product_of_carriage if one} == {"HGH25CA"}


def test_the_report_is_written_as_the_command_line_writes_it(driver: Any, folder: Path) -> None:
    with served(folder) as server:
        driver.get(server.link)
        load(driver)
        opened(driver, "Keep")
        press(driver, "Write the report")
        page = until(lambda: (folder / "report.html").read_text(), "a report")
        result = guideload.simulate(
            guideload.Machine.from_toml(folder / "machine.toml"),
            guideload.Moves.from_toml(folder / "moves.toml").motion(),
        )
        assert page == guideload.html_report.run_page(result)


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


def test_a_file_that_another_program_changes_is_read_again(driver: Any, folder: Path) -> None:
    with served(folder) as server:
        driver.get(server.link)
        before = load(driver)
        file = folder / "machine.toml"
        file.write_text(file.read_text().replace('"1250 kg"', '"1900 kg"'))
        changed(driver, before)
        assert field(driver, "machine-body-mass").get_attribute("value") == "1900 kg"
