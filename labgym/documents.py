"""JSON documents: bounded reading of files nobody trusts, validation, atomic writing, canonical hashing."""

from __future__ import annotations

import hashlib
import json
import os
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, ClassVar, Self

from pydantic import BaseModel, ConfigDict, ValidationError

from labgym.errors import DocumentError

MAX_BYTES = 32 * 1024 * 1024
MAX_DEPTH = 32
MAX_MAGNITUDE = 1e9
MAX_INTEGER = 2**53


class Record(BaseModel):
    """A frozen part of a document; unknown fields and non-finite numbers are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, str_max_length=20_000)

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """Return a copy with some fields replaced; cached properties of the original are not copied."""
        copy = super().model_copy(update=update, deep=deep)
        for name in copy.__dict__.keys() - type(self).model_fields.keys():
            del copy.__dict__[name]
        return copy


class Document(Record):
    """A record that is a file of its own, tagged with `"schema": "labgym.<kind>/<n>"`."""

    SCHEMA: ClassVar[str]

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read and validate a file.

        Raises:
            DocumentError: missing, too large, not JSON, too deep, another schema, or a field out of order.
        """
        return cls.parse(read_json(path), path)

    @classmethod
    def parse(cls, data: Any, source: object = "document") -> Self:
        """Validate plain data read from `source`.

        Raises:
            DocumentError: another schema or a field out of order; names the source and the field.
        """
        if not isinstance(data, dict):
            raise DocumentError(source, "", f"expected a JSON object, got {type(data).__name__}")
        schema = data.get("schema")
        if schema != cls.SCHEMA:
            raise DocumentError(source, "schema", f"expected {cls.SCHEMA!r}, got {str(schema)[:80]!r}")
        try:
            return cls.model_validate({key: value for key, value in data.items() if key != "schema"})
        except ValidationError as error:
            raise document_error(source, error) from None

    def to_json(self) -> dict[str, Any]:
        """Return the document as plain JSON data, schema first."""
        return {"schema": self.SCHEMA, **self.model_dump(mode="json")}

    def save(self, path: str | Path) -> Path:
        """Write the document atomically and return its path."""
        return write_json(path, self.to_json())


def document_error(source: object, error: ValidationError) -> DocumentError:
    """Turn pydantic's report into one line that names the first offending field."""
    first = error.errors(include_url=False, include_input=True)[0]
    field = ".".join(str(part) for part in first["loc"])
    more = f" (and {error.error_count() - 1} more)" if error.error_count() > 1 else ""
    given = "" if isinstance(first["input"], dict | list) else f", got {repr(first['input'])[:60]}"
    return DocumentError(source, field, " ".join(first["msg"].split()) + given + more)


def read_json(path: str | Path, max_bytes: int = MAX_BYTES) -> Any:
    """Read a JSON file within bounds of size, depth and magnitude.

    Raises:
        DocumentError: missing, not a regular file, too large, not UTF-8, not JSON, NaN or infinite or beyond
            1e9 in magnitude (2^53 for integers), or nested deeper than 32.
    """
    path = Path(path)
    if not path.is_file():
        raise DocumentError(path, "", "no such file" if not path.exists() else "not a regular file")
    try:
        with path.open("rb") as stream:
            raw = stream.read(max_bytes + 1)
    except OSError as error:
        raise DocumentError(path, "", f"cannot be read ({error.strerror})") from None
    if len(raw) > max_bytes:
        raise DocumentError(path, "", f"larger than {max_bytes} bytes")
    return parse_json(raw, path)


def parse_json(raw: bytes, source: object) -> Any:
    """Return the plain data of JSON bytes that came from `source`, within bounds of depth and magnitude.

    Raises:
        DocumentError: as `read_json`; names the source.
    """
    try:
        data = json.loads(raw.decode("utf-8"), parse_constant=float)
    except RecursionError:
        raise DocumentError(source, "", f"nested deeper than {MAX_DEPTH} levels") from None
    except UnicodeDecodeError:
        raise DocumentError(source, "", "not UTF-8 text") from None
    except ValueError as error:
        raise DocumentError(source, "", f"not valid JSON ({error})") from None
    _check_bounds(data, source)
    return data


def write_json(path: str | Path, data: Any) -> Path:
    """Write JSON atomically: to a temporary file in the same folder, then rename."""
    return write_text(path, json.dumps(data, indent=1, ensure_ascii=False, allow_nan=False) + "\n")


def write_text(path: str | Path, text: str) -> Path:
    """Write UTF-8 text atomically; parent folders are made."""
    return write_bytes(path, text.encode("utf-8"))


def write_bytes(path: str | Path, data: bytes) -> Path:
    """Write bytes atomically; parent folders are made. A crash leaves the old file or the new one, never half."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(data)
        Path(temporary).chmod(0o644)
        Path(temporary).replace(path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise
    return path


def canonical_hash(data: Any) -> str:
    """Return the SHA-256 of canonical JSON: sorted keys, no spaces, no NaN."""
    text = json.dumps(data, sort_keys=True, separators=(",", ":"), ensure_ascii=True, allow_nan=False)
    return hashlib.sha256(text.encode("ascii")).hexdigest()


def files_digest(paths: Iterable[Path]) -> str:
    """Return the SHA-256 of files' names and contents, in the order given."""
    digest = hashlib.sha256()
    for path in paths:
        digest.update(path.name.encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()


def _check_bounds(data: Any, source: object) -> None:
    stack: list[tuple[Any, str, int]] = [(data, "", 1)]
    while stack:
        value, field, depth = stack.pop()
        if depth > MAX_DEPTH:
            raise DocumentError(source, field[:80], f"nested deeper than {MAX_DEPTH} levels")
        if isinstance(value, dict):
            stack.extend((item, f"{field}.{key}"[:200].lstrip("."), depth + 1) for key, item in value.items())
        elif isinstance(value, list):
            stack.extend((item, f"{field}.{index}"[:200].lstrip("."), depth + 1) for index, item in enumerate(value))
        elif isinstance(value, int | float) and not isinstance(value, bool):
            limit = MAX_INTEGER if isinstance(value, int) else MAX_MAGNITUDE
            if not abs(value) <= limit:
                raise DocumentError(
                    source, field, f"number {str(value)[:40]} is not finite or beyond {limit:g} in magnitude"
                )
