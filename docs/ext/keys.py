"""The directives `keys`, the keys of machine, study or catalogue files, and `ranges`, the ranges of their values.

Both are made from what checks the files.
"""

from __future__ import annotations

from typing import Any

from docutils import nodes
from docutils.parsers.rst import Directive

from guideload.base.ranges import OF_MACHINES, OF_MOTIONS
from guideload.cli.file_schema import file_schema

HEADER = ("key", "value", "if left out", "what it is")
WIDTHS = (18, 22, 16, 44)
KINDS = {
    "number": "number",
    "string": "text",
    "array": "list",
    "boolean": "true or false",
    "integer": "whole number",
    "object": "table",
}
LARGE = 1e6  # bounds beyond are not worth a reader's time


class Keys(Directive):
    """A table of the file's own keys, and a section for each table in it."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        schema = file_schema(self.arguments[0])
        parts = [self._table(schema)]
        for name, part in sorted(schema["$defs"].items(), key=lambda item: _order(schema, item[0])):
            section = nodes.section(ids=[f"{self.arguments[0]}-{name.lower()}"])
            section += nodes.title(text=_heading(schema, name))
            for text in part.get("description", "").split("\n\n"):
                section += nodes.paragraph(text=" ".join(text.split()).replace("`", ""))
            section += self._table(part)
            parts.append(section)
        return parts

    def _table(self, part: dict[str, Any]) -> nodes.table:
        group = nodes.tgroup(cols=len(HEADER))
        group += [nodes.colspec(colwidth=width) for width in WIDTHS]
        group += nodes.thead("", _row([nodes.Text(text) for text in HEADER]))
        body = nodes.tbody()
        required = part.get("required", ())
        for key, value in part["properties"].items():
            default = "needed" if key in required else _default(value)
            words = value.get("description", "").removesuffix(f" [{value.get('x-unit')}]").replace("`", "")
            texts = [nodes.Text(text) for text in (kind(value), default, words)]
            body += _row([nodes.literal(text=key), *texts])
        group += body
        return nodes.table("", group, classes=["keys"])


class Ranges(Directive):
    """A table of the ranges of quantities: machines or motions."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        group = nodes.tgroup(cols=4)
        group += [nodes.colspec(colwidth=width) for width in (26, 14, 20, 40)]
        group += nodes.thead(
            "", _row([nodes.Text(text) for text in ("quantity", "unit", "magnitude", "reason")])
        )
        body = nodes.tbody()
        for one in {"machines": OF_MACHINES, "motions": OF_MOTIONS}[self.arguments[0]]:
            reach = f"{one.least:g} to {one.most:g}" if one.least else f"up to {one.most:g}"
            unit = "" if one.unit == "1" else one.unit
            name = one.name.removeprefix("an ").removeprefix("a ")
            body += _row([nodes.Text(text) for text in (name, unit, reach, one.reason)])
        group += body
        return [nodes.table("", group, classes=["keys"])]


def kind(value: dict[str, Any]) -> str:
    """What a value may be, in words: "number or text with unit, in N/m, > 0"."""
    if "$ref" in value:
        return f"table, see {value['$ref'].rsplit('/', 1)[1]}"
    options = value.get("anyOf") or value.get("oneOf")
    if options:
        words = [word for option in options for word in kind(option).split(" or ")]
        return " or ".join(dict.fromkeys(words))
    if "enum" in value or "const" in value:
        return ", ".join(f'"{word}"' for word in value.get("enum", [value.get("const")]))
    if value.get("type") == "array":
        if "prefixItems" in value:
            return f"[{', '.join(_short(item) for item in value['prefixItems'])}]"
        return f"list of {kind(value['items'])}"
    types = value["type"] if isinstance(value["type"], list) else [value["type"]]
    words = " or ".join(KINDS[word] for word in types)
    unit = value.get("x-unit", "1")
    if unit != "1":
        words += f" with unit, in {unit}"
    for bound, sign in (("exclusiveMinimum", ">"), ("minimum", "≥"), ("maximum", "≤")):
        of_range = "x-unit" in value and value.get(bound) != 0  # ranges have a table of their own
        if bound in value and value[bound] < LARGE and not of_range:
            words += f", {sign} {value[bound]:g}"
    return words


def _short(item: dict[str, Any]) -> str:
    return item.get("x-unit", "number") if "prefixItems" not in item else kind(item)


def _default(value: dict[str, Any]) -> str:
    default = value.get("default")
    if default in (None, []):
        return ""
    return ", ".join(map(str, default)) if isinstance(default, list) else str(default).lower()


def _row(cells: list[nodes.Node]) -> nodes.row:
    return nodes.row("", *(nodes.entry("", nodes.paragraph("", "", cell)) for cell in cells))


def _holders(schema: dict[str, Any], name: str) -> list[str]:
    """The keys of the file whose value is the part, or a list of it."""
    return [key for key, value in schema["properties"].items() if f"/{name}'" in str(value)]


def _order(schema: dict[str, Any], name: str) -> int:
    held = _holders(schema, name)
    return list(schema["properties"]).index(held[0]) if held else len(schema["properties"])


def _heading(schema: dict[str, Any], name: str) -> str:
    held = _holders(schema, name)
    if not held:
        return name
    listed = schema["properties"][held[0]].get("type") == "array"
    return f"[[{held[0]}]]: {name}" if listed else f"[{held[0]}]: {name}"


def setup(app: Any) -> dict[str, bool]:
    app.add_directive("keys", Keys)
    app.add_directive("ranges", Ranges)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
