"""The dialect of the API that a server understands, learned from its rejections."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

from labgym.llm.config import LanguageModelConfig
from labgym.llm.messages import Question, is_strict


@dataclass
class Dialect:
    """The parts of the API that a server supports.

    Attributes:
        format: how the form of the reply is requested: json_schema, json_object or text.
        limit: name of the option for the maximum length of a reply.
        plain: whether to send neither temperature nor seed.
    """

    format: str = "json_schema"
    limit: str = "max_tokens"
    plain: bool = False

    def body(self, request: Question, config: LanguageModelConfig) -> dict[str, Any]:
        """Return the request as JSON data."""
        messages = [message.wire() for message in request.messages]
        body: dict[str, Any] = {"model": config.model, "messages": messages, self.limit: config.max_tokens}
        if not self.plain:
            body |= {"temperature": config.temperature, "seed": config.seed}
        schema = request.schema
        if self.format == "json_schema":
            shape = {"name": request.answer.__name__, "schema": schema, "strict": is_strict(schema)}
            return {**body, "response_format": {"type": "json_schema", "json_schema": shape}}
        text = json.dumps(schema, ensure_ascii=False)
        messages.append({"role": "system", "content": f"Reply with one JSON object of this JSON Schema:\n{text}"})
        return {**body, "response_format": {"type": "json_object"}} if self.format == "json_object" else body

    def adapt(self, complaint: str) -> bool:
        """Drop the feature that an error message of the server names; return whether anything was dropped."""
        if "max_completion_tokens" in complaint and self.limit == "max_tokens":
            self.limit = "max_completion_tokens"
        elif ("temperature" in complaint or "seed" in complaint) and not self.plain:
            self.plain = True
        elif self.format == "text" or not ("status 400" in complaint or "status 422" in complaint):
            return False
        else:
            self.format = "json_object" if self.format == "json_schema" else "text"
        return True
