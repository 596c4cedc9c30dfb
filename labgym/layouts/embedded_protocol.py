"""A protocol as a field of another document, with its schema tag."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BeforeValidator, GetJsonSchemaHandler, PlainSerializer
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from labgym.documents import tagged
from labgym.protocols import Protocol


def _untagged(data: Any) -> Any:
    """Return an embedded document without its schema tag, which must be that of a protocol."""
    if not isinstance(data, dict) or "schema" not in data:
        return data
    if data["schema"] != Protocol.SCHEMA:
        raise ValueError(f"expected schema {Protocol.SCHEMA!r}, got {str(data['schema'])[:80]!r}")
    return {key: value for key, value in data.items() if key != "schema"}


class _TaggedSchema:
    """Puts the schema tag into the JSON Schema of an embedded protocol."""

    def __get_pydantic_json_schema__(self, core_schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        reference = handler(core_schema)
        body = handler.resolve_ref_schema(reference)
        body.update(tagged(body, Protocol))
        return reference


EmbeddedProtocol = Annotated[
    Protocol, BeforeValidator(_untagged), PlainSerializer(Protocol.to_json, return_type=dict), _TaggedSchema()
]
