"""Replies of the server, and the answers in them."""

from __future__ import annotations

from typing import Any, TypeVar

from pydantic import BaseModel, Field, ValidationError

from labgym.documents import document_error, parse_json
from labgym.errors import DocumentError
from labgym.llm.config import LanguageModelConfig
from labgym.llm.errors import LanguageModelError

Answer = TypeVar("Answer", bound=BaseModel)
QUOTED = 80


class _Lenient(BaseModel):
    """A part of a reply."""


class _Tokens(_Lenient):
    prompt_tokens: int = Field(default=0, ge=0)
    completion_tokens: int = Field(default=0, ge=0)


class _Reply(_Lenient):
    content: str | None = None
    refusal: str | None = None
    tool_calls: list[Any] | None = None


class _Choice(_Lenient):
    message: _Reply
    finish_reason: str | None = None


class Completion(_Lenient):
    """The parts of a chat completion that are used; further fields are ignored."""

    choices: list[_Choice]
    usage: _Tokens | None = None

    @property
    def tokens(self) -> _Tokens:
        """Number of tokens read and written; 0 if the server does not report it."""
        return self.usage or _Tokens()

    def text(self, config: LanguageModelConfig) -> str:
        """Return the text of the reply.

        Raises:
            LanguageModelError: the reply is a refusal, empty, a tool call, or truncated.
        """
        if not self.choices:
            raise LanguageModelError("empty", f"language model {config.model}: the reply has no choices; ask again")
        choice = self.choices[0]
        reply = choice.message
        if reply.refusal or choice.finish_reason == "content_filter":
            why = " ".join((reply.refusal or "content filter").split())[:QUOTED]
            raise LanguageModelError("refused", f"language model {config.model} refuses: {why!r}; reword the question")
        if choice.finish_reason == "length":
            remedy = f"raise LABGYM_LLM_MAX_TOKENS above {config.max_tokens}"
            raise LanguageModelError("truncated", f"language model {config.model}: the reply is cut off; {remedy}")
        if not (reply.content or "").strip():
            what = "calls a tool, although none is offered" if reply.tool_calls else "is empty"
            raise LanguageModelError("empty", f"language model {config.model}: the reply {what}; ask again")
        # JSON can contain half a surrogate pair, which cannot be written to a file.
        return str(reply.content).encode("utf-8", "replace").decode("utf-8")


def validated(text: str, answer: type[Answer], where: str) -> Answer:
    """Return the answer in a reply's text; `where` is appended to the error message.

    Raises:
        LanguageModelError: the text is not JSON, or does not satisfy `answer`.
    """
    try:
        return answer.model_validate(parse_json(_unfenced(text).encode("utf-8", "replace"), "reply"))
    except ValidationError as error:
        problem = str(document_error("reply", error))
    except DocumentError as error:
        problem = str(error)
    remedy = f"ask again, or choose a model that follows a schema{where}"
    raise LanguageModelError("malformed", f"language model: {problem}; {remedy}", text) from None


def _unfenced(text: str) -> str:
    """Return the content of a Markdown code block, as written by models without JSON mode; other text unchanged."""
    lines = text.strip().splitlines()
    if len(lines) > 2 and lines[0].strip() in ("```", "```json") and lines[-1].strip() == "```":
        return "\n".join(lines[1:-1])
    return text
