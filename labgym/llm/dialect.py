"""How a request is put to the server at hand, learnt from what it rejects."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

from labgym.llm.config import LanguageModelConfig
from labgym.llm.messages import Request, is_strict


@dataclass
class Dialect:
    """What a server understands of the API.

    Attributes:
        format: how it is told the shape of the reply: json_schema, json_object or, at worst, text.
        limit: its name for the longest reply.
        plain: whether it takes neither temperature nor seed.
    """

    format: str = "json_schema"
    limit: str = "max_tokens"
    plain: bool = False

    def body(self, request: Request, config: LanguageModelConfig) -> dict[str, Any]:
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
        """Give up what a server's complaint is about; tell whether there was something to give up."""
        if "max_completion_tokens" in complaint and self.limit == "max_tokens":
            self.limit = "max_completion_tokens"
        elif ("temperature" in complaint or "seed" in complaint) and not self.plain:
            self.plain = True
        elif self.format == "text" or not ("status 400" in complaint or "status 422" in complaint):
            return False
        else:
            self.format = "json_object" if self.format == "json_schema" else "text"
        return True
