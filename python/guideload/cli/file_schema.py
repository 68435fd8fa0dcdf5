"""The JSON schemas of the kinds of files, from their pydantic models."""

from __future__ import annotations

from pkgutil import resolve_name
from typing import Any

from pydantic import BaseModel
from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue

from guideload.base.arguments import checked
from guideload.base.config import interval
from guideload.base.errors import ArgumentError, shown
from guideload.base.ranges import STIFFNESS, Range
from guideload.catalogue.preload_class import stiffness_or
from guideload.cli.options import FileKind

DIALECT = "https://json-schema.org/draft/2020-12/schema"
BOUNDS = {"above": "exclusiveMinimum", "least": "minimum", "most": "maximum"}

MODELS: dict[FileKind, str] = {
    "machine": "machine.machine:Machine",
    "study": "study.options:StudyFile",
    "catalogue": "catalogue.catalogue:Catalogue",
    "motion": "motion.moves:Moves",
    "duty": "duty.description:DutyFile",
    "monitor": "monitor.description:MonitorFile",
    "identify": "identification.description:IdentifyFile",
}


class FileSchema(GenerateJsonSchema):
    """Schema in which a float may also be text with a unit; unit and bounds come from the validator of the field."""

    def float_schema(self, schema: Any) -> JsonSchemaValue:
        return {"type": ["number", "string"]}

    def nullable_schema(self, schema: Any) -> JsonSchemaValue:
        return self.generate_inner(schema["schema"])  # TOML has no null: the key is omitted instead

    def default_schema(self, schema: Any) -> JsonSchemaValue:
        json_schema = super().default_schema(schema)
        default = json_schema.get("default")
        if default is None or isinstance(default, dict):
            json_schema.pop("default", None)
        return json_schema

    def field_title_should_be_set(self, schema: Any) -> bool:
        return False

    def function_before_schema(self, schema: Any) -> JsonSchemaValue:
        json_schema = super().function_before_schema(schema)
        function = schema["function"]["function"]
        if getattr(function, "func", None) is stiffness_or:  # a number or a table
            json_schema["anyOf"][0] = self._number("N/m", STIFFNESS, exclusiveMinimum=0.0)
        if function is interval:
            return {"anyOf": [json_schema["prefixItems"][0], json_schema]}
        if json_schema.get("items") == {"type": "string"}:  # a single text means a list with this entry
            return {"anyOf": [{"type": "string"}, json_schema]}
        return json_schema

    def function_plain_schema(self, schema: Any) -> JsonSchemaValue:
        checks = getattr(schema["function"]["function"], "keywords", {})  # arguments of a partial
        bounds = {word: checks[key] for key, word in BOUNDS.items() if checks.get(key) is not None}
        if "unit" in checks:
            return self._number(checks["unit"], checks.get("within"), **bounds)
        return {"type": "integer" if bounds else ["number", "string", "array"], **bounds}

    def _number(self, unit: str, within: Range | None, **bounds: float) -> JsonSchemaValue:
        """A number, or text with a unit, within these bounds and the range of its quantity."""
        if within is not None:
            least = within.least if "exclusiveMinimum" in bounds else -within.most
            bounds = {"minimum": least, "maximum": within.most} | bounds
        return {"type": ["number", "string"], "x-unit": unit, **bounds}


@checked
def file_schema(kind: FileKind) -> dict[str, Any]:
    """The JSON schema of a kind of file, as `guideload schema` prints it.

    Parameters
    ----------
    kind
        "machine", "study", "catalogue", "motion", "duty", "monitor" or "identify".

    Returns
    -------
    dict
        JSON schema, draft 2020-12. A description ends with the SI unit of the value, as [N/m].
    """
    if kind not in MODELS:
        raise ArgumentError(f"kind: expected one of {', '.join(MODELS)}, got {shown(kind)}")
    model: type[BaseModel] = resolve_name(f"guideload.{MODELS[kind]}")
    schema = model.model_json_schema(schema_generator=FileSchema)
    _add_units(schema)
    return {"$schema": DIALECT, **schema}


def _add_units(node: Any) -> None:
    if isinstance(node, dict):
        unit = node.get("x-unit", "1")
        if unit != "1":
            node["description"] = f"{node.get('description', '')} [{unit}]".lstrip()
        for child in node.values():
            _add_units(child)
    elif isinstance(node, list):
        for child in node:
            _add_units(child)
