"""The JSON Schemas of spec and statements files, for editors; ``python -m conformance.spec.schema``."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core import CoreSchema, core_schema

from conformance.spec.document import SpecDocument
from conformance.spec.statements import StatementsDocument

DIALECT = "https://json-schema.org/draft/2020-12/schema"
DEFAULT_PATH = Path("device_specs/schema.json")
STATEMENTS_NAME = "statements.schema.json"
_INTEGER_KEY = r"^-?(0x[0-9A-Fa-f]+|0b[01]+|0o[0-7]+|[0-9]+)$"


class _Generator(GenerateJsonSchema):
    """Keys that are integers in YAML are texts in JSON; titles that repeat a key say nothing."""

    def dict_schema(self, schema: core_schema.DictSchema) -> JsonSchemaValue:
        result = super().dict_schema(schema)
        keys = schema.get("keys_schema")
        if keys is not None and self.generate_inner(keys).get("type") == "integer":
            result["propertyNames"] = {"pattern": _INTEGER_KEY}
        return result

    def field_title_should_be_set(self, schema: Any) -> bool:
        del schema
        return False

    def generate(self, schema: CoreSchema, mode: Any = "validation") -> JsonSchemaValue:
        return {"$schema": DIALECT, **super().generate(schema, mode)}


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of a device spec file."""
    schema = SpecDocument.model_json_schema(schema_generator=_Generator)
    return {**schema, "title": "CANopen device spec"}


def statements_schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of a statements file."""
    schema = StatementsDocument.model_json_schema(schema_generator=_Generator)
    return {**schema, "title": "Statements of a device's manual"}


def write(path: Path) -> None:
    """Write the schema of specs to a file and that of statements beside it."""
    schemas = {path: json_schema(), path.with_name(STATEMENTS_NAME): statements_schema()}
    for place, schema in schemas.items():
        text = json.dumps(schema, indent=2, ensure_ascii=False)
        place.write_text(text + "\n", encoding="utf-8", newline="\n")


if __name__ == "__main__":
    write(Path(sys.argv[1]) if sys.argv[1:] else DEFAULT_PATH)
