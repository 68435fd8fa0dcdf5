"""The directive `keys`: the keys of machine or study files, from the schema that checks them."""

from __future__ import annotations

from typing import Any

from docutils import nodes
from docutils.parsers.rst import Directive

from guideload.cli.file_schema import file_schema

HEADER = ("key", "value", "if left out", "what it is")
WIDTHS = (18, 22, 16, 44)
KINDS = {"string": "text", "boolean": "true or false", "integer": "whole number", "object": "table"}


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
            words = value.get("description", "").removesuffix(f" [{value.get('x-unit')}]")
            texts = [nodes.Text(text) for text in (kind(value), default, words)]
            body += _row([nodes.literal(text=key), *texts])
        group += body
        return nodes.table("", group, classes=["keys"])


def kind(value: dict[str, Any]) -> str:
    """What a value may be, in words: "number or text with unit, > 0, in N/m"."""
    if "$ref" in value:
        return f"table, see {value['$ref'].rsplit('/', 1)[1]}"
    if "anyOf" in value:
        return " or ".join(kind(option) for option in value["anyOf"])
    if "enum" in value:
        return ", ".join(f'"{word}"' for word in value["enum"])
    if value.get("type") == "array":
        if "prefixItems" in value:
            return f"[{', '.join(_short(item) for item in value['prefixItems'])}]"
        return f"list of {kind(value['items'])}"
    words = KINDS.get(value.get("type", "")) if isinstance(value.get("type"), str) else None
    if words is None:
        words = "number or text" if value.get("x-unit", "1") == "1" else "number or text with unit"
    for bound, sign in (("exclusiveMinimum", ">"), ("minimum", "≥"), ("maximum", "≤")):
        if bound in value and abs(value[bound]) < 2**40:
            words += f", {sign} {value[bound]:g}"
    return words + (f", in {value['x-unit']}" if value.get("x-unit", "1") != "1" else "")


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
    return {"parallel_read_safe": True, "parallel_write_safe": True}
