"""What is sent to a model: messages with pictures, the shape of the answer, and the identity of the whole request."""

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
        images: pictures as PNG bytes, after the text.

    Raises:
        OptionError: a picture that is no PNG or too large, too many of them, or too long a text.
    """

    role: Literal["system", "user", "assistant"]
    text: str
    images: tuple[bytes, ...] = ()

    def __post_init__(self) -> None:
        if len(self.text) > MAX_TEXT:
            raise OptionError(f"a message of {len(self.text)} characters; at most {MAX_TEXT}")
        if len(self.images) > MAX_IMAGES:
            raise OptionError(f"a message with {len(self.images)} pictures; at most {MAX_IMAGES}")
        for image in self.images:
            if not image.startswith(PNG) or len(image) > MAX_IMAGE_BYTES:
                raise OptionError(f"a picture must be a PNG of at most {MAX_IMAGE_BYTES} bytes, got {len(image)} bytes")

    def wire(self) -> dict[str, Any]:
        """Return the message as the API wants it, pictures as data URLs."""
        if not self.images:
            return {"role": self.role, "content": self.text}
        urls = ["data:image/png;base64," + base64.b64encode(image).decode("ascii") for image in self.images]
        pictures = [{"type": "image_url", "image_url": {"url": url}} for url in urls]
        return {"role": self.role, "content": [{"type": "text", "text": self.text}, *pictures]}

    def identity(self) -> dict[str, Any]:
        """Return what tells the message from others, pictures by their SHA-256."""
        pictures = [hashlib.sha256(image).hexdigest() for image in self.images]
        return {"role": self.role, "text": self.text, "images": pictures}


@dataclass(frozen=True)
class Request:
    """A question as a whole.

    Attributes:
        prompt: name and version of the prompt that it was made from, such as annotate-asset/1.
        answer: the model that a reply has to satisfy.
    """

    prompt: str
    messages: tuple[Message, ...]
    answer: type[BaseModel]

    @property
    def schema(self) -> dict[str, Any]:
        """JSON Schema of the answer, closed: every property is required and no other is allowed."""
        schema: dict[str, Any] = closed(self.answer.model_json_schema(mode="validation"))
        return schema

    def key(self, config: LanguageModelConfig) -> str:
        """Return the SHA-256 of all that can change the reply; neither the address nor the key is part of it."""
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
    """Return a JSON Schema whose objects require all their properties, as servers that constrain replies want it.

    Objects with free keys stay as they are. Titles and defaults go: they say nothing that a model needs.
    """
    if isinstance(schema, list):
        return [closed(item) for item in schema]
    if not isinstance(schema, dict):
        return schema
    kept = {
        name: {key: closed(value) for key, value in part.items()} if name in ("properties", "$defs") else closed(part)
        for name, part in schema.items()
        if name not in ("default", "title")
    }
    if "properties" in kept:
        kept["required"] = list(kept["properties"])
        kept["additionalProperties"] = False
    return kept


def is_strict(schema: Any) -> bool:
    """Tell whether every object of a closed schema lists its properties, which strict servers insist on."""
    if isinstance(schema, list):
        return all(is_strict(item) for item in schema)
    if not isinstance(schema, dict):
        return True
    if schema.get("type") == "object" and schema.get("additionalProperties") is not False:
        return False
    return all(is_strict(item) for item in schema.values())
