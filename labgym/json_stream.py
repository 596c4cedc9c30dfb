"""JSON documents with a long list of records, which are read one by one."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from labgym.documents import (
    Record,
    check_bounds,
    has_more_values,
    not_json,
    read_bytes,
    uncollected,
    validating,
)
from labgym.errors import DocumentError

MAX_STREAM_BYTES = 64 * 1024 * 1024
MAX_STREAM_ELEMENTS = 6_000_000
"""Largest number of values in a document whose records are read one by one; 10,000 LabNav episodes have 4.5 million."""
MAX_STREAM_FIELDS = 2_000_000
"""Largest number of colons in such a document. A field takes up to 200 bytes, other values up to 96: 700 MB in all."""
_SPACE = re.compile(r"[ \t\n\r]*+")
_DECODER = json.JSONDecoder(parse_constant=float)


def stream_json(path: str | Path, schema: str, name: str, record: type[Record], most: int) -> Any:
    """Read a JSON object that has a long list of records; each becomes a record before the next one is decoded.

    Args:
        path: the file. schema: of the document; in a document with another one, the list stays plain data.
        name: field of the list. record: of its items. most: largest number of records.

    Raises:
        DocumentError: as `read_json` with the limits of streamed documents, an invalid record, or too many of them.
    """
    raw = read_bytes(path, MAX_STREAM_BYTES)
    if raw.count(b":") > MAX_STREAM_FIELDS or has_more_values(raw, MAX_STREAM_ELEMENTS):
        limits = f"{MAX_STREAM_ELEMENTS} values or {MAX_STREAM_FIELDS} fields"
        raise DocumentError(path, "", f"more than {limits}; split it into several files")
    try:
        with uncollected():
            reader = JsonReader(raw.decode("utf-8-sig"))
            data = _read_fields(reader, path, schema, name, record, most) if reader.at("{") else reader.value()
            reader.end()
    except (RecursionError, ValueError) as error:
        raise not_json(path, error) from None
    return data


def _read_fields(reader: JsonReader, path: object, schema: str, name: str, record: type[Record], most: int) -> Any:
    """Return the fields of an object, with the list `name` as records."""
    data: dict[str, Any] = {}
    for key in reader.fields():
        if key != name or data.get("schema", schema) != schema or not reader.at("["):
            data[key] = reader.value()
            check_bounds(data[key], path, key)
            continue
        records = data[key] = []
        for item in reader.items():
            if len(records) == most:
                raise DocumentError(path, name, f"more than {most} entries; split it into several files")
            check_bounds(item, path, name, len(records))
            with validating(path, name, len(records)):
                records.append(record.model_validate(item))
    return data


@dataclass
class JsonReader:
    """Position in a JSON text that is read value by value.

    Raises:
        json.JSONDecodeError: the text is not JSON.
    """

    text: str
    position: int = 0

    def at(self, mark: str) -> bool:
        """Skip white space and return whether a mark follows."""
        space = _SPACE.match(self.text, self.position)
        self.position = self.position if space is None else space.end()
        return self.text.startswith(mark, self.position)

    def pass_over(self, mark: str) -> None:
        """Move behind a mark."""
        if not self.at(mark):
            raise json.JSONDecodeError(f"Expecting {mark!r} delimiter", self.text, self.position)
        self.position += len(mark)

    def value(self) -> Any:
        """Return the value that follows and move behind it."""
        self.at("")
        value, self.position = _DECODER.raw_decode(self.text, self.position)
        return value

    def items(self) -> Iterator[Any]:
        """Yield the items of the list that follows."""
        for _ in self._parts("[", "]"):
            yield self.value()

    def fields(self) -> Iterator[str]:
        """Yield the keys of the object that follows; the caller reads the value of each."""
        for _ in self._parts("{", "}"):
            if not self.at('"'):
                raise json.JSONDecodeError(
                    "Expecting property name enclosed in double quotes", self.text, self.position
                )
            key = self.value()
            self.pass_over(":")
            yield key

    def end(self) -> None:
        """Check that nothing follows."""
        self.at("")
        if self.position < len(self.text):
            raise json.JSONDecodeError("Extra data", self.text, self.position)

    def _parts(self, opening: str, closing: str) -> Iterator[None]:
        self.pass_over(opening)
        if not self.at(closing):
            yield
            while self.at(","):
                self.pass_over(",")
                yield
        self.pass_over(closing)
