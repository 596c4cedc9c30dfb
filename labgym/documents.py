"""JSON documents: bounded reading of untrusted files, validation, atomic writing, canonical hashing."""

from __future__ import annotations

import gc
import hashlib
import json
import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, ClassVar, Self

from pydantic import BaseModel, ConfigDict, GetCoreSchemaHandler, ValidationError, model_serializer
from pydantic_core import CoreSchema

from labgym.errors import DocumentError, OptionError, optional_package
from labgym.temporary import temporary_file

MAX_BYTES = 32 * 1024 * 1024
MAX_HEADER_BYTES = 1024 * 1024
"""Largest header of a safetensors file; that of a network of 200 tensors has 20 kB."""
MAX_DEPTH = 32
MAX_MAGNITUDE = 1e9
MAX_INTEGER = 2**53
MAX_ELEMENTS = 1_000_000
"""Largest number of values in a document, counted by the commas and opening brackets outside its texts.

CPython needs up to 200 bytes for each (an object with one field), so that a document of 32 MB takes at most 200 MB for
its values and 300 MB for its texts. The largest published document has 8 661 values.
"""
MAX_FAULTS = 10_000
"""Largest number of invalid fields that are listed to name the first; each takes a kilobyte."""
_FILE_SUFFIX = re.compile(
    r"\.(jsonl?|ya?ml|toml|txt|md|csv|xml|urdf|usd[acz]?|glb|gltf|obj|stl|dxf|dwg|pdf|svg|png|jpe?g|gif|mp4|html|zip|gz"
    r"|parquet|npz|pt|onnx|safetensors|py)",
    re.IGNORECASE,
)
"""Suffixes of files; a folder whose name has one was probably meant as a file."""
_TEXT = re.compile(rb'"[^"\\]*+(?:\\.[^"\\]*+)*+(?:"|\\?\Z)', re.DOTALL)
"""A JSON text; one that is not closed ends with the document, so that matching takes linear time."""


def _stop_at_first_fault(schema: Any) -> None:
    """Let the lists of a pydantic schema stop at their first invalid item; nested records have done so themselves."""
    if isinstance(schema, dict):
        if schema.get("type") in ("list", "tuple", "set", "frozenset"):
            schema["fail_fast"] = True
        for key, part in schema.items():
            if key not in ("cls", "metadata", "serialization") and isinstance(part, dict | list):
                _stop_at_first_fault(part)
    elif isinstance(schema, list):
        for part in schema:
            _stop_at_first_fault(part)


class Record(BaseModel):
    """A frozen part of a document; unknown fields and non-finite numbers are errors."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, str_max_length=20_000)

    @classmethod
    def __get_pydantic_core_schema__(cls, source: type[BaseModel], handler: GetCoreSchemaHandler) -> CoreSchema:
        """Return pydantic's schema, with lists that report their first invalid item only.

        A report on every item of a hostile list takes a kilobyte an item.
        """
        schema = handler(source)
        _stop_at_first_fault(schema)
        return schema

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """Return a copy with some fields replaced; cached properties of the original are not copied."""
        copy = super().model_copy(update=update, deep=deep)
        for name in copy.__dict__.keys() - type(self).model_fields.keys():
            del copy.__dict__[name]
        return copy


class Growing(Record):
    """A record that has gained fields: they are written only if they differ from their default.

    A document that does not use them keeps its bytes.
    """

    ADDED: ClassVar[frozenset[str]] = frozenset()
    """Names of the fields that are left out at their default."""

    @model_serializer(mode="wrap")
    def _serialized(self, handler: Callable[[Any], dict[str, Any]]) -> dict[str, Any]:
        fields = type(self).model_fields
        plain = {name for name in self.ADDED if getattr(self, name) == fields[name].get_default()}
        return {name: value for name, value in handler(self).items() if name not in plain}


class Document(Record):
    """A record with its own file, tagged with `"schema": "labgym.<kind>/<n>"`."""

    SCHEMA: ClassVar[str]

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read and validate a file.

        Raises:
            DocumentError: the file is missing, too large, not JSON or nested too deeply, has another schema, or a
                field is invalid.
        """
        return cls.parse(cls._read(path), path)

    @classmethod
    def _read(cls, path: str | Path) -> Any:
        """Return the data of a file; a kind of document with a long list of records streams them."""
        return read_json(path)

    @classmethod
    def parse(cls, data: Any, source: object = "document") -> Self:
        """Validate plain data read from `source`.

        Raises:
            DocumentError: another schema, or an invalid field; names the source and the field.
        """
        if not isinstance(data, dict):
            raise DocumentError(source, "", f"expected a JSON object, got {type(data).__name__}")
        if "schema" not in data:
            raise DocumentError(source, "schema", f"missing; this kind of file has {cls.SCHEMA!r} there")
        if data["schema"] != cls.SCHEMA:
            raise DocumentError(source, "schema", f"expected {cls.SCHEMA!r}, got {str(data['schema'])[:80]!r}")
        with validating(source):
            return cls.model_validate({key: value for key, value in data.items() if key != "schema"})

    def to_json(self) -> dict[str, Any]:
        """Return the document as plain JSON data, schema first."""
        return {"schema": self.SCHEMA, **self.model_dump(mode="json")}

    def save(self, path: str | Path) -> Path:
        """Write the document atomically and return its path."""
        return write_json(path, self.to_json())


def tagged(schema: dict[str, Any], document: type[Document]) -> dict[str, Any]:
    """Return the JSON Schema of a document's fields with the required field `schema` put first."""
    tag = {"const": document.SCHEMA, "title": "Schema"}
    return {
        **schema,
        "properties": {"schema": tag, **schema.get("properties", {})},
        "required": ["schema", *schema.get("required", ())],
    }


def document_error(source: object, error: ValidationError, *parents: object) -> DocumentError:
    """Return pydantic's report as a one-line error that names the first invalid field, below its `parents`."""
    if error.error_count() > MAX_FAULTS:
        return DocumentError(source, "", f"not a {error.title}: {error.error_count()} fields are unknown or invalid")
    first = error.errors(include_url=False, include_input=True)[0]
    field = ".".join(str(part) for part in (*parents, *first["loc"]))
    more = f" (and {error.error_count() - 1} more)" if error.error_count() > 1 else ""
    value = "" if isinstance(first["input"], dict | list) else f", got {repr(first['input'])[:60]}"
    return DocumentError(source, field, " ".join(first["msg"].removeprefix("Value error, ").split()) + value + more)


@contextmanager
def validating(source: object, *parents: object) -> Iterator[None]:
    """Turn pydantic's report of an invalid value in a block into the error of its source.

    Raises:
        DocumentError: a value in the block is invalid; names the first field, below its `parents`.
    """
    try:
        yield
    except ValidationError as error:
        raise document_error(source, error, *parents) from None


def read_bytes(path: str | Path, max_bytes: int) -> bytes:
    """Return the content of a file of at most `max_bytes` bytes.

    Raises:
        DocumentError: the file is missing, not a regular file, unreadable or larger.
    """
    path = Path(path)
    if not path.is_file():
        raise DocumentError(path, "", "no such file" if not path.exists() else "not a regular file")
    try:
        with path.open("rb") as stream:
            # A read of `max_bytes` would reserve that much memory for any file.
            size = min(max_bytes, os.fstat(stream.fileno()).st_size) + 1
            raw = stream.read(size)
            if len(raw) == size:
                raw += stream.read(max_bytes + 1 - size)
    except OSError as error:
        raise DocumentError(path, "", f"cannot be read ({error.strerror})") from None
    if len(raw) > max_bytes:
        raise DocumentError(path, "", f"the file is larger than {max_bytes} bytes")
    return raw


def read_json(path: str | Path, max_bytes: int = MAX_BYTES, max_elements: int = MAX_ELEMENTS) -> Any:
    """Read a JSON file within bounds of size, depth, magnitude and number of values.

    Raises:
        DocumentError: the file is missing, not a regular file, too large, not UTF-8 or not JSON; a number is not
            finite or exceeds 1e9 in magnitude (2^53 for integers); the nesting exceeds 32 levels; or there are more
            than `max_elements` values.
    """
    raw = read_bytes(path, max_bytes)
    return parse_json(raw, path, max_elements)


def read_yaml(path: str | Path, max_bytes: int, needed_for: str) -> Any:
    """Read a YAML file of plain data within the bounds of `read_json`.

    Aliases are refused: a few of them stand for billions of values.

    Args:
        path: the file. max_bytes: its largest size. needed_for: what PyYAML is needed for, in the error.

    Raises:
        DocumentError: as `read_json`, or the file has an alias.
        MissingDependencyError: PyYAML is not installed.
    """
    with optional_package("pyyaml", needed_for, "cad"):
        import yaml
    raw = read_bytes(path, max_bytes)
    try:
        text = raw.decode("utf-8")
        depth = 0
        for token in yaml.scan(text, yaml.SafeLoader):
            if isinstance(token, yaml.AliasToken):
                raise DocumentError(path, "", "has an alias (*name), which is not read: write the value out")
            # PyYAML takes time that grows with the square of the depth.
            kind = type(token).__name__
            depth += ("Start" in kind and "Stream" not in kind) - ("End" in kind and "Stream" not in kind)
            if depth > 2 * MAX_DEPTH:
                raise DocumentError(path, "", f"nested deeper than {MAX_DEPTH} levels")
        data = yaml.safe_load(text)
    except UnicodeDecodeError:
        raise DocumentError(path, "", "not UTF-8 text") from None
    except DocumentError:
        raise
    except (yaml.YAMLError, ValueError, RecursionError, TypeError, AttributeError, LookupError, OverflowError) as error:
        reason = " ".join(str(error).split())[:120] or type(error).__name__
        raise DocumentError(path, "", f"not valid YAML ({reason})") from None
    check_bounds(data, path)
    return data


def check_safetensors_header(path: Path) -> None:
    """Check the size of the JSON header of a safetensors file, before a library reads it.

    Raises:
        DocumentError: it is too long, which a million empty tensors make it.
    """
    with path.open("rb") as stream:
        size = int.from_bytes(stream.read(8), "little")
    if MAX_HEADER_BYTES < size <= path.stat().st_size:  # the library refuses a header beyond the end
        raise DocumentError(path, "", f"has a header of {size} bytes; at most {MAX_HEADER_BYTES} are read")


def parse_json(raw: bytes, source: object, max_elements: int = MAX_ELEMENTS) -> Any:
    """Return the data in JSON bytes from `source`, within bounds of depth, magnitude and number of values.

    Raises:
        DocumentError: as `read_json`; names the source.
    """
    data = load_json(raw, source, max_elements)
    check_bounds(data, source)
    return data


def load_json(raw: bytes, source: object, max_elements: int = MAX_ELEMENTS) -> Any:
    """Return the data in JSON bytes from `source`, after a check that their values fit in memory.

    Raises:
        DocumentError: not UTF-8, not JSON, nested too deeply, or more than `max_elements` values; names the source.
    """
    if has_more_values(raw, max_elements):
        raise DocumentError(source, "", f"more than {max_elements} values; split it into several files")
    try:
        with uncollected():
            return json.loads(raw.decode("utf-8-sig"), parse_constant=float)
    except (RecursionError, ValueError) as error:
        raise not_json(source, error) from None


@contextmanager
def uncollected() -> Iterator[None]:
    """Pause the collection of garbage: JSON data have no cycles, and visiting them again takes half of the time."""
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()


def not_json(source: object, error: Exception) -> DocumentError:
    """Return the error of a document that Python's decoder refuses."""
    if isinstance(error, RecursionError):
        return DocumentError(source, "", f"nested deeper than {MAX_DEPTH} levels")
    if isinstance(error, UnicodeDecodeError):
        return DocumentError(source, "", "not UTF-8 text: save it as JSON in UTF-8")
    return DocumentError(source, "", f"not valid JSON ({error})")


def folder_path(path: str | Path) -> Path:
    """Return the path of a folder to write.

    Raises:
        OptionError: it is named like a file, and is not a folder yet.
    """
    path = Path(path)
    if _FILE_SUFFIX.fullmatch(path.suffix) and not path.is_dir():
        raise OptionError(f"{path} is named like a file, but a folder is written: name a folder, such as {path.stem}")
    return path


def write_json(path: str | Path, data: Any) -> Path:
    """Write JSON atomically: into a temporary file in the same folder, which is then renamed."""
    return write_bytes(path, json_bytes(data))


def json_bytes(data: Any) -> bytes:
    """Return the content of a JSON file: UTF-8, indented, with a final newline."""
    return (json.dumps(data, indent=1, ensure_ascii=False, allow_nan=False) + "\n").encode("utf-8")


def write_text(path: str | Path, text: str) -> Path:
    """Write UTF-8 text atomically, creating parent folders."""
    return write_bytes(path, text.encode("utf-8"))


def write_bytes(path: str | Path, data: bytes | Iterable[bytes]) -> Path:
    """Write bytes atomically, creating parent folders: after a crash the file has its old or its new content.

    Args:
        data: the content, in one piece or in several.

    Raises:
        OSError: the file cannot be written; names the file, also if the disk is full.
    """
    path = Path(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with temporary_file(path.parent) as (handle, temporary):
            for piece in (data,) if isinstance(data, bytes) else data:
                view = memoryview(piece)
                while view:
                    view = view[os.write(handle, view) :]
            os.fchmod(handle, 0o644)
            temporary.replace(path)
    except OSError as error:
        raise _naming(error, path) from None
    return path


def append_text(path: str | Path, text: str) -> None:
    """Append UTF-8 text to a file and flush it to disk.

    Raises:
        OSError: the file cannot be written; names the file, also if the disk is full.
    """
    try:
        with Path(path).open("a", encoding="utf-8") as stream:
            stream.write(text)
            stream.flush()
            os.fsync(stream.fileno())
    except OSError as error:
        raise _naming(error, Path(path)) from None


def canonical_hash(data: Any) -> str:
    """Return the SHA-256 of canonical JSON: sorted keys, no spaces, no NaN."""
    text = json.dumps(data, sort_keys=True, separators=(",", ":"), ensure_ascii=True, allow_nan=False)
    return hashlib.sha256(text.encode("ascii")).hexdigest()


def files_digest(paths: Iterable[Path]) -> str:
    """Return the SHA-256 of the names and contents of files, in their order."""
    digest = hashlib.sha256()
    for path in paths:
        digest.update(path.name.encode() + b"\0")
        with path.open("rb") as stream:
            while chunk := stream.read(2**20):
                digest.update(chunk)
        digest.update(b"\0")
    return digest.hexdigest()


def _naming(error: OSError, path: Path) -> OSError:
    """Return an error that names the file of the user; a full disk names none, a failed rename the temporary one."""
    return OSError(error.errno, error.strerror, str(path))


def has_more_values(raw: bytes, most: int) -> bool:
    """Return whether JSON bytes hold more than `most` values; takes no memory."""
    if sum(map(raw.count, (b",", b"[", b"{"))) <= most:
        return False
    at = values = 0
    for text in _TEXT.finditer(raw):
        values += sum(raw.count(mark, at, text.start()) for mark in (b",", b"[", b"{"))
        at = text.end()
        if values > most:
            return True
    return values + sum(raw.count(mark, at) for mark in (b",", b"[", b"{")) > most


def check_bounds(data: Any, source: object, *parents: object) -> None:
    """Check the bounds of depth and magnitude of a value below its `parents`: keys and numbers of items."""
    fault = _first_fault(data, 1 + len(parents))
    if fault is not None:
        path, problem = fault
        field = ".".join([*(str(parent)[:80] for parent in parents), *reversed(path)])
        raise DocumentError(source, field[:200], problem)


def _first_fault(value: Any, depth: int) -> tuple[list[str], str] | None:
    """Return the first value out of bounds: its path, innermost key first, and the problem; None if all are valid.

    The path is built only for a fault, so that checking a large document takes no memory.
    """
    if depth > MAX_DEPTH:
        return [], f"nested deeper than {MAX_DEPTH} levels"
    if isinstance(value, dict | list):
        for key, item in value.items() if isinstance(value, dict) else enumerate(value):
            # Most values are such leaves; a call for each takes most of the time.
            kind = type(item)
            if depth < MAX_DEPTH and (
                (kind is float and -MAX_MAGNITUDE <= item <= MAX_MAGNITUDE)
                or kind is str
                or (kind is int and -MAX_INTEGER <= item <= MAX_INTEGER)
            ):
                continue
            fault = _first_fault(item, depth + 1)
            if fault is not None:
                fault[0].append(str(key)[:80])
                return fault
    elif type(value) in (int, float):
        limit = MAX_INTEGER if isinstance(value, int) else MAX_MAGNITUDE
        if not abs(value) <= limit:
            return [], f"number {str(value)[:40]} is not finite or exceeds {limit:g} in magnitude"
    return None
