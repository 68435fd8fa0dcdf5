"""A machine or motion file as a form, made from its schema; errors stand beside their fields."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cache
from typing import Any

from nicegui import ui

import guideload
from guideload.app import document, widgets
from guideload.app.answer import Problem
from guideload.app.state import Session

# Keys that are always shown; others are shown if the file has them, or added by the user.
MAIN = {
    "body": ("mass", "center_of_mass", "inertia"),
    "rails": ("name", "position"),
    "carriages": ("name", "rail", "x", "product", "preload_class"),
    "points": ("name", "at", "settle_window"),
    "drive": ("gear_ratio",),
    "friction": ("coefficient", "seal"),
    "life": ("life", "safety", "application"),
    "report": ("project", "customer", "author", "date"),
    "limits": ("speed", "acceleration", "jerk", "profile"),
    "moves": ("distance", "target", "speed", "time", "dwell"),
    "": ("name", "gravity", "free", "start", "repeat"),
}
WIDE = ("inertia", "gravity", "center_of_mass", "position", "at", "free", "direction", "point", "product")


@cache
def packaged() -> str:
    """The packaged products as options in HTML, which a browser finds by name, or by maker and size."""
    option = '<option value="{0.name}" label="{0.maker} {0.size} {0.name}">'
    return "".join(map(option.format, guideload.packaged_catalogue().products))


class Form:
    """The form of one file of the session.

    part      "machine" or "moves"
    sections  tables of the file in the order in which they are shown; "" for the keys outside tables
    """

    def __init__(self, session: Session, part: str, sections: Sequence[str]) -> None:
        self.session, self.part, self.sections = session, part, sections
        self.schema = guideload.file_schema("machine" if part == "machine" else "motion")
        self.fields: dict[document.Path, Any] = {}
        self.structure: Any = None
        self.open = {"body", "moves", "limits", ""}
        self.others = ui.column().classes("gap-0").props("role=alert")
        self.box = ui.column().classes("gap-0")
        self.show()

    # ---- what is shown

    def show(self) -> None:
        """The values of the session that changed; fields are made anew only if keys or tables came or went."""
        text = getattr(self.session.state, self.part)
        try:
            values = document.values(text)
        except guideload.GuideloadError:
            return  # the answer says it
        structure = [(path, self._shown(path, table)) for path, table in self._tables(values)]
        if structure != self.structure:
            self.structure = structure
            self.box.clear()
            self.fields.clear()
            self.shown: dict[document.Path, str] = {}
            with self.box:
                self._build(values)
        for path, field in self.fields.items():
            shown = document.shown(document.value_at(text, path))
            if shown != self.shown.get(path, ""):  # else it may be the one in which the user types
                self.shown[path] = shown
                if not isinstance(field, ui.select):
                    field.value = shown
                elif shown and shown not in field.options:  # refused by the answer, beside the field
                    field.set_options([*field.options, shown], value=shown)
                else:
                    field.value = shown or None

    def show_problems(self, problems: Iterable[Problem]) -> None:
        """Each problem beside its field; those of values without a field above all fields."""
        texts: dict[document.Path, str] = {}
        without: list[str] = []
        for one in problems:
            if one.part == self.part:
                starts = (one.path[:n] for n in range(len(one.path), 0, -1))
                at = next((path for path in starts if path in self.fields), None)
                if at is None:
                    without.append(one.text)
                else:
                    texts[at] = one.text
        for path, field in self.fields.items():
            field.error = texts.get(path)
        self.others.clear()
        with self.others:
            for text in without:
                ui.label(text).style(f"color: {widgets.COLORS['bad']}")

    def _tables(self, values: dict[str, Any]) -> Iterable[tuple[document.Path, dict[str, Any]]]:
        """Path and values of each table that is shown."""
        for section in self.sections:
            found = values.get(section, {}) if section else values
            entries: Iterable[tuple[Any, Any]]
            if self._is_list(section):
                entries = enumerate(found) if isinstance(found, list) else ()
            elif section == "carriage_types":
                entries = found.items() if isinstance(found, dict) else ()
            else:
                yield (section,) if section else (), found if isinstance(found, dict) else {}
                continue
            yield from (((section, key), one) for key, one in entries if isinstance(one, dict))

    def _build(self, values: dict[str, Any]) -> None:
        tables = list(self._tables(values))
        for section in self.sections:
            mine = [(path, one) for path, one in tables if (path[0] if path else "") == section]
            repeated = self._is_list(section)
            if not mine and not repeated:
                continue
            title = (section or "general") + (f" ({len(mine)})" if repeated else "")
            with ui.expansion(title.replace("_", " "), value=section in self.open) as box:
                box.on_value_change(lambda e, s=section: (self.open.add if e.value else self.open.discard)(s))
                for path, one in mine:
                    self._build_table(section, path, one, repeated)
                if repeated:
                    add = ui.button(f"Add to {section}", icon="add").props("flat size=sm")
                    add.on_click(lambda s=section: self._add(s))

    def _build_table(self, section: str, path: document.Path, one: dict[str, Any], repeated: bool) -> None:
        keys, shown = self._keys(section), self._shown(path, one)
        with ui.row().classes("entry items-start", remove="items-center"):
            for key in shown:
                self._build_field((*path, key), key, keys[key])
            absent = {key: f"{key}: {keys[key].get('description', '')}" for key in keys if key not in shown}
            if absent:
                more = ui.select(absent, label="more", on_change=lambda e: self._more(path, keys, e.value))
                more.classes("narrow")
            if repeated:
                name = f"{section} {one.get('name', int(path[1]) + 1)}"
                drop = ui.button(icon="delete", on_click=lambda: self._drop(section, int(path[1])))
                drop.props("flat round").props["aria-label"] = f"Remove {name}"

    def _build_field(self, path: document.Path, key: str, schema: dict[str, Any]) -> None:
        unit = document.unit_of(schema)
        label = key.replace("_", " ") + (f" [{unit}]" if unit != "1" else "")
        options = schema.get("enum") or (["true", "false"] if schema.get("type") == "boolean" else None)
        field: Any
        if options:
            field = ui.select([str(one) for one in options], label=label, clearable=True)
            field.on_value_change(lambda e: self._typed(path, e.value or "", schema))
        else:
            field = ui.input(label)
            if key == "product":
                choice = f'<datalist id="{field.html_id}-datalist">{packaged()}</datalist>'
                ui.html(choice, sanitize=False).classes("hidden")
            field.on("change", lambda: self._typed(path, str(field.value or ""), schema))
        field.props("hide-hint hide-bottom-space stack-label")
        field.classes("wide" if key in WIDE else "mid" if options or key == "name" else "")
        field.props["hint"] = schema.get("description", "")
        field.mark("/".join(map(str, path)))
        name = "-".join(map(str, (self.part, *path))).replace(" ", "_")
        field.props["input-id"] = field.props["for"] = name
        self.fields[path] = field

    def _shown(self, path: document.Path, table: dict[str, Any]) -> list[str]:
        """The keys of a table that have fields."""
        section = str(path[0]) if path else ""
        keys = self._keys(section)
        return list(dict.fromkeys(key for key in (*MAIN.get(section, ()), *table) if key in keys))

    # ---- what the user does

    def _typed(self, path: document.Path, written: str, schema: dict[str, Any]) -> None:
        if written == self.shown.get(path, ""):
            return  # shown, not typed
        text = getattr(self.session.state, self.part)
        value = document.typed(written, schema)
        self.shown.pop(path, None)  # shown as it is read, with its unit
        with widgets.errors_shown():
            if value != document.value_at(text, path):
                self.session.set(self.part, {path: value})
        self.show()

    def _more(self, path: document.Path, keys: dict[str, Any], key: str | None) -> None:
        """Add a key, with the first example of its description as its value."""
        if key is not None:
            example = _example(keys[key])
            with widgets.errors_shown():
                self.session.set(self.part, {(*path, key): example})

    def _add(self, section: str) -> None:
        """Add a table like the last one, under a name of its own."""
        values = document.values(getattr(self.session.state, self.part))
        mine = [one for path, one in self._tables(values) if path[:1] == (section,)]
        entry = dict(mine[-1]) if mine else {"name": section.removesuffix("s")}
        names = {one.get("name") for one in mine}
        if "name" in entry:
            base = str(entry["name"])
            entry["name"] = next(name for n in range(2, 999) if (name := f"{base} {n}") not in names)
        with widgets.errors_shown():
            self.session.add(self.part, section, entry)

    def _drop(self, section: str, index: int) -> None:
        with widgets.errors_shown():
            self.session.drop(self.part, section, index)

    # ---- the schema

    def _properties(self, section: str) -> dict[str, Any]:
        found: dict[str, Any] = self.schema["properties"].get(section, {})
        return found

    def _is_list(self, section: str) -> bool:
        return self._properties(section).get("type") == "array"

    def _keys(self, section: str) -> dict[str, Any]:
        """The keys of a table and their schemas, without tables in it."""
        node = self._properties(section) if section else self.schema
        for name in ("items", "additionalProperties"):
            node = node.get(name) or node if section else node
        if "$ref" in node:
            node = self.schema["$defs"][node["$ref"].rpartition("/")[2]]
        return {key: one for key, one in node["properties"].items() if not self._is_table(one)}

    def _is_table(self, schema: dict[str, Any]) -> bool:
        inner = schema.get("items", schema)
        return isinstance(inner, dict) and ("$ref" in inner or "additionalProperties" in schema)


def _example(schema: dict[str, Any]) -> Any:
    """A value to begin with: the default, the first choice, or the first example of the description."""
    if "default" in schema:
        return schema["default"]
    if schema.get("enum"):
        return schema["enum"][0]
    quoted = schema.get("description", "").split('"')
    if len(quoted) > 2:
        return quoted[1]
    return True if schema.get("type") == "boolean" else "?" if schema.get("type") == "string" else 1.0
