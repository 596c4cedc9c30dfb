"""Recorded replies on disk, so that a run can be repeated without the server."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, ClassVar

from pydantic import Field

from labgym.documents import Document
from labgym.errors import DocumentError

MAX_REPLY = 4_000_000
"""Greatest length of a reply, characters."""


class RecordedReply(Document):
    """The reply of a model to one request.

    Attributes:
        request: SHA-256 of the request (see `Question.key`).
        prompt: name and version of the prompt.
        model: name of the model. text: text of the reply.
        tokens_in, tokens_out: tokens read and written, as counted by the server.
    """

    SCHEMA: ClassVar[str] = "labgym.llm-reply/1"

    request: Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
    prompt: str
    model: str
    text: Annotated[str, Field(max_length=MAX_REPLY)]
    tokens_in: Annotated[int, Field(ge=0)] = 0
    tokens_out: Annotated[int, Field(ge=0)] = 0


class ReplayCache:
    """A folder of recorded replies; each file is named after the request's hash."""

    def __init__(self, folder: str | Path) -> None:
        self.folder = Path(folder)

    def path(self, key: str) -> Path:
        """Return the path of the reply to a request, whether or not it exists."""
        return self.folder / key[:2] / f"{key}.json"

    def get(self, key: str) -> RecordedReply | None:
        """Return the recorded reply, or None.

        Raises:
            DocumentError: the file is damaged or belongs to another request.
        """
        path = self.path(key)
        if not path.exists():
            return None
        reply = RecordedReply.load(path)
        if reply.request != key:
            raise DocumentError(path, "request", "belongs to another request; delete the file")
        return reply

    def put(self, reply: RecordedReply) -> None:
        """Write a reply atomically; it replaces an earlier reply to the same request."""
        reply.save(self.path(reply.request))
