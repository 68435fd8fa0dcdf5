"""Values that no file should have: of another type, not finite, huge, tiny, empty; each is drawn from a seed."""

from __future__ import annotations

import re
from pathlib import Path

from damaged_bytes import Generator

from guideload.base.errors import GuideloadError
from guideload.base.toml import TomlPlace, read_toml

# As TOML writes them. No name becomes "nan" or "inf", which a report would show rightly.
LITERALS = (
    *("nan", "inf", "-inf", "[nan, nan, nan]", "[[nan, inf]]", '"1e999 N"'),
    *("0", "0.0", "-0.0", "-1", "1", "2", "1.5", "-2.5e-3", "3", "7", "100", "1000", "1e6", "1e9", "-1e9"),
    *("1e17", "1e25", "1e100", "1e154", "1e155", "1e300", "1e308", "-1e308", "1.8e308", "5e8"),
    *("1e-6", "1e-9", "1e-15", "1e-100", "1e-160", "1e-300", "1e-308", "-1e-308", "5e-324"),
    *("9223372036854775807", "-9223372036854775808", "18446744073709551616", "1" + "0" * 400, "0xffff"),
    *('""', '" "', '"x"', '"1"', '"0"'),
    *('"1e308"', '"\\u0000"', '"\\u2028"', '"\\U0001F642"', '"' + "x" * 3000 + '"'),
    *('"../../x"', '"/"', '"."', '".."', '"*"'),
    *('"a.b[0]"', '"%s{0}"', '"moves.toml"', '"trace.csv"', '"plain.toml"'),
    *("true", "false", "[]", "[[]]", "{}", "[{}]"),
    *("{ a = 1 }", "[1]", "[1, 2]", "[1, 2, 3]", "[0, 0, 0]", "[1, true]"),
    *('["x"]', '["x", "x"]', "[[0, 0], [0, 0]]"),
    *("[1e308, 1e308, 1e308]", "[1e-300, 0, 0]", '["1 m", "2 kg"]'),
    *("1979-05-27", "07:32:00", "1979-05-27T07:32:00Z"),
    *('"1e-308 m"', '"1e308 N"', '"1e308 s"', '"1 kg"', '"1 m"'),
    *('"0 N"', '"1 N/um"', '"100 %"', '"1e308 %"', '"0 %"'),
    *('"-1 m"', '"1 ms"', '"1e6 m"', '"1 Hz"', '"rest"'),
    *('"auto"', '"life"', '"value"', '"carriage"', '"normal"'),
)
POWERS = (
    *(-320, -300, -200, -160, -100, -50, -30, -12, -6, -3, -1),
    *(1, 3, 6, 9, 12, 30, 50, 100, 160, 200, 300, 307),
)
QUANTITY = re.compile(r'(?!"-?[\d.]+")"?-?\d')  # a number, or a text that begins with one and has a unit
NUMBER = re.compile(r"(?<![\w.])-?\d+\.?\d*(?:[eE][+-]?\d+)?")


def hostile_word(word: str, rng: Generator) -> str:
    """An option's value in place of this one."""
    if NUMBER.search(word) and rng.random() < 0.5:
        return _scaled(word, rng)
    return str(rng.choice(LITERALS)).strip('"').replace("\\u0000", "")


def hostile_toml(file: Path, rng: Generator) -> str:
    """The text of a TOML file with one to three hostile places; it need not be TOML any more."""
    text = file.read_text(encoding="utf-8")
    for _ in range(int(rng.choice([1, 1, 1, 2, 3]))):
        file.write_text(text, encoding="utf-8")
        try:
            values = read_toml(file)[1]
        except GuideloadError:
            break
        text = KINDS[int(rng.integers(len(KINDS)))](text, list(values.items()), rng)
    file.write_text(text, encoding="utf-8")
    return text


Places = list[tuple[tuple[str | int, ...], TomlPlace]]


def _pick(places: Places, rng: Generator, header: bool = False) -> TomlPlace | None:
    """A place of a value, or of the header of a table."""
    found = [place for _, place in places if (not place.text) == header]
    return found[int(rng.integers(len(found)))] if found else None


def _replaced(text: str, place: TomlPlace, new: str) -> str:
    return text[: place.first] + new + text[place.last :]


def _scaled(text: str, rng: Generator) -> str:
    """One of its numbers times a power of ten, or with another sign."""
    numbers = list(NUMBER.finditer(text))
    if not numbers:
        return text
    number = numbers[int(rng.integers(len(numbers)))]
    if rng.random() < 0.15:
        new = number[0][1:] if number[0].startswith("-") else "-" + number[0]
    elif rng.random() < 0.05 and QUANTITY.match(text):
        new = str(rng.choice(["nan", "inf", "-inf"]))
    else:
        digits, _, exponent = number[0].lower().partition("e")
        new = f"{digits}e{int(exponent or 0) + int(rng.choice(POWERS))}"
    return text[: number.start()] + new + text[number.end() :]


def _literal(text: str, places: Places, rng: Generator) -> str:
    place = _pick(places, rng)
    return _replaced(text, place, str(rng.choice(LITERALS))) if place else text


def _number(text: str, places: Places, rng: Generator) -> str:
    place = _pick([pair for pair in places if NUMBER.search(pair[1].text)], rng)
    return _replaced(text, place, _scaled(text[place.first : place.last], rng)) if place else text


def _of_another_key(text: str, places: Places, rng: Generator) -> str:
    place, other = _pick(places, rng), _pick(places, rng)
    return _replaced(text, place, text[other.first : other.last]) if place and other else text


def _left_out(text: str, places: Places, rng: Generator) -> str:
    place = _pick(places, rng)
    if place is None:
        return text
    start = text.rfind("\n", 0, place.first) + 1
    end = text.find("\n", place.last)
    return text[:start] + (text[end + 1 :] if end >= 0 else "")


def _header(text: str, places: Places, rng: Generator) -> str:
    place = _pick(places, rng, header=True)
    if place is None:
        return text
    name = text[place.first : place.last].strip("[] ")
    return _replaced(
        text, place, str(rng.choice([f"[[{name}]]", f"[{name}]", "", f"[{name}.x]", f"[[{name}.x]]"]))
    )


def _table_twice(text: str, places: Places, rng: Generator) -> str:
    place = _pick(places, rng, header=True)
    if place is None:
        return text
    end = text.find("\n[", place.last)
    return text + "\n" + text[place.first : end if end >= 0 else len(text)] + "\n"


def _table_left_out(text: str, places: Places, rng: Generator) -> str:
    place = _pick(places, rng, header=True)
    if place is None:
        return text
    end = text.find("\n[", place.last)
    return text[: place.first] + (text[end + 1 :] if end >= 0 else "")


def _more_key(text: str, places: Places, rng: Generator) -> str:
    """A key that a table of this or another file has, in a table that may not have it."""
    place = _pick(places, rng, header=True)
    row = f"{rng.choice(KEYS)} = {rng.choice(LITERALS)}"
    return _replaced(text, place, f"{text[place.first : place.last]}\n{row}") if place else f"{row}\n{text}"


KINDS = (
    *[_literal] * 6,
    *[_number] * 6,
    _of_another_key,
    _left_out,
    _header,
    _table_twice,
    _table_left_out,
    *[_more_key] * 3,
)
KEYS: list[str] = []  # of all kinds of files, from their schemas


def learn_keys() -> None:
    """Fill KEYS."""
    from guideload.cli.file_schema import file_schema

    found = set[str]()
    for kind in ("machine", "catalogue", "study", "motion", "duty", "identify", "monitor"):
        schema = file_schema(kind)
        for one in (schema, *schema.get("$defs", {}).values()):
            found |= set(one.get("properties", {}))
    KEYS[:] = sorted(found)
