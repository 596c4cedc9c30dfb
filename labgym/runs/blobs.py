"""Large constant parts of a run's calls, such as weights: sent to each machine once and named by their hash."""

from __future__ import annotations

import hashlib
import io
import pickle
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from labgym.errors import LabgymError


@dataclass(frozen=True)
class Blob:
    """Bytes that many calls of a run share. Executors on other machines send them once."""

    content: bytes = field(repr=False)

    @cached_property
    def digest(self) -> str:
        """SHA-256 of the content."""
        return hashlib.sha256(self.content).hexdigest()


def dumps(value: object, put: Callable[[Blob], None]) -> bytes:
    """Pickle a value without the blobs in it.

    Args:
        value: the value.
        put: called with each blob, also several times with one.
    """
    buffer = io.BytesIO()
    _Pickler(buffer, put).dump(value)
    return buffer.getvalue()


def loads(pickled: bytes, get: Callable[[str], bytes]) -> Any:
    """Return the value that `dumps` pickled, of this run's coordinator.

    Args:
        pickled: bytes of `dumps`.
        get: returns the content of a blob by its digest.

    Raises:
        LabgymError: a blob does not have its digest.
    """
    return _Unpickler(io.BytesIO(pickled), get).load()


class _Pickler(pickle.Pickler):
    def __init__(self, stream: io.BytesIO, put: Callable[[Blob], None]) -> None:
        super().__init__(stream, protocol=pickle.HIGHEST_PROTOCOL)
        self._put = put

    def persistent_id(self, value: Any) -> str | None:
        if not isinstance(value, Blob):
            return None
        self._put(value)
        return value.digest


class _Unpickler(pickle.Unpickler):
    def __init__(self, stream: io.BytesIO, get: Callable[[str], bytes]) -> None:
        super().__init__(stream)
        self._get = get

    def persistent_load(self, digest: str) -> Blob:
        blob = Blob(self._get(digest))
        if blob.digest != digest:
            raise LabgymError(f"data of the run arrived damaged: SHA-256 {blob.digest[:12]}, expected {digest[:12]}")
        return blob
