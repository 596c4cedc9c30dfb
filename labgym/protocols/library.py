"""The experiment library: the published protocols."""

from __future__ import annotations

from functools import lru_cache
from types import MappingProxyType

from labgym.artefacts import artefacts
from labgym.errors import DocumentError, UnknownNameError
from labgym.protocols.model import Protocol


def protocols() -> dict[str, Protocol]:
    """Return the published protocols by id, sorted by id; read once a process."""
    return dict(_published())


def get(protocol_id: str) -> Protocol:
    """Return a published protocol by id.

    Raises:
        UnknownNameError: there is none of that id; lists those there are.
    """
    library = _published()
    if not isinstance(protocol_id, str) or protocol_id not in library:
        raise UnknownNameError("protocol", protocol_id, library)
    return library[protocol_id]


@lru_cache(maxsize=1)
def _published() -> MappingProxyType[str, Protocol]:
    library: dict[str, Protocol] = {}
    for file in sorted((artefacts("assets") / "protocols").glob("*.json")):
        protocol = Protocol.load(file)
        if protocol.id != file.stem:
            raise DocumentError(file, "id", f"expected {file.stem!r}, the name of the file, got {protocol.id!r}")
        library[protocol.id] = protocol
    return MappingProxyType(library)
