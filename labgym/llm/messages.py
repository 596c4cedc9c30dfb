"""Requests to a model: messages with pictures, the schema of the answer, and the identity of the request."""

from __future__ import annotations

import base64
import hashlib
from dataclasses import dataclass
from typing import Any, Literal

from pydantic import BaseModel

from labgym.documents import canonical_hash
from labgym.errors import OptionError
from labgym.llm.config import LanguageModelConfig

PNG = b"\x89PNG\r\n\x1a\n"
MAX_IMAGE_BYTES = 4 * 1024 * 1024
MAX_IMAGES = 16
MAX_TEXT = 400_000


@dataclass(frozen=True)
class Message:
    """One turn of a conversation.

    Attributes:
        role: sender of the message. text: its text.
        images: pictures as PNG bytes, sent after the text.

    Raises:
        OptionError: a picture is not a PNG or too large, there are too many pictures, or the text is too long.
    """

    role: Literal["system", "user", "assistant"]
    text: str
    images: tuple[bytes, ...] = ()

    def __post_init__(self) -> None:
        if len(self.text) > MAX_TEXT:
            raise OptionError(f"the message has {len(self.text)} characters; at most {MAX_TEXT} are allowed")
        if len(self.images) > MAX_IMAGES:
            raise OptionError(f"the message has {len(self.images)} pictures; at most {MAX_IMAGES} are allowed")
        for image in self.images:
            if not image.startswith(PNG) or len(image) > MAX_IMAGE_BYTES:
                raise OptionError(f"a picture must be a PNG of at most {MAX_IMAGE_BYTES} bytes, got {len(image)} bytes")

    def wire(self) -> dict[str, Any]:
        """Return the message in the API's format, pictures as data URLs."""
        if not self.images:
            return {"role": self.role, "content": self.text}
        urls = ["data:image/png;base64," + base64.b64encode(image).decode("ascii") for image in self.images]
        pictures = [{"type": "image_url", "image_url": {"url": url}} for url in urls]
        return {"role": self.role, "content": [{"type": "text", "text": self.text}, *pictures]}

    def identity(self) -> dict[str, Any]:
        """Return the identity of the message, with pictures as their SHA-256."""
        pictures = [hashlib.sha256(image).hexdigest() for image in self.images]
        return {"role": self.role, "text": self.text, "images": pictures}


@dataclass(frozen=True)
class Question:
    """A question with the form of its answer.

    Attributes:
        prompt: name and version of its prompt, such as annotate-asset/1.
        messages: the conversation.
        answer: the pydantic model of the answer.
    """

    prompt: str
    messages: tuple[Message, ...]
    answer: type[BaseModel]

    @property
    def schema(self) -> dict[str, Any]:
        """Closed JSON Schema of the answer: all properties are required and no others are allowed."""
        schema: dict[str, Any] = closed(self.answer.model_json_schema(mode="validation"))
        return schema

    def key(self, config: LanguageModelConfig) -> str:
        """Return the SHA-256 of everything that can change the reply, without address and key."""
        return canonical_hash(
            {
                "model": config.model,
                "temperature": config.temperature,
                "seed": config.seed,
                "max_tokens": config.max_tokens,
                "prompt": self.prompt,
                "schema": self.schema,
                "messages": [message.identity() for message in self.messages],
            }
        )


def closed(schema: Any) -> Any:
    """Return a JSON Schema whose objects require all their properties, as servers with constrained decoding expect.

    Objects with free keys are unchanged. Titles and defaults are removed, since a model does not need them.
    """
    if isinstance(schema, list):
        return [closed(item) for item in schema]
    if not isinstance(schema, dict):
        return schema
    result = {
        name: {key: closed(value) for key, value in part.items()} if name in ("properties", "$defs") else closed(part)
        for name, part in schema.items()
        if name not in ("default", "title")
    }
    if "properties" in result:
        result["required"] = list(result["properties"])
        result["additionalProperties"] = False
    return result


def is_strict(schema: Any) -> bool:
    """Return whether every object of a closed schema lists its properties, as strict servers require."""
    if isinstance(schema, list):
        return all(is_strict(item) for item in schema)
    if not isinstance(schema, dict):
        return True
    if schema.get("type") == "object" and schema.get("additionalProperties") is not False:
        return False
    return all(is_strict(item) for item in schema.values())
