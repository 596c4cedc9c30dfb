"""What a server replies, and the answer in it."""

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


class _Said(_Lenient):
    content: str | None = None
    refusal: str | None = None
    tool_calls: list[Any] | None = None


class _Choice(_Lenient):
    message: _Said
    finish_reason: str | None = None


class Completion(_Lenient):
    """A chat completion as far as it is used here; what the API may say beyond is ignored."""

    choices: list[_Choice]
    usage: _Tokens | None = None

    @property
    def tokens(self) -> _Tokens:
        """How many tokens were read and written; 0 where the server does not say."""
        return self.usage or _Tokens()

    def text(self, config: LanguageModelConfig) -> str:
        """Return what was said.

        Raises:
            LanguageModelError: a refusal, nothing, a call of a tool, or half a reply.
        """
        if not self.choices:
            raise LanguageModelError("empty", f"language model {config.model}: the reply holds no choice; ask again")
        choice = self.choices[0]
        said = choice.message
        if said.refusal or choice.finish_reason == "content_filter":
            why = " ".join((said.refusal or "content filter").split())[:QUOTED]
            raise LanguageModelError("refused", f"language model {config.model} refuses: {why!r}; reword the question")
        if choice.finish_reason == "length":
            remedy = f"raise LABGYM_LLM_MAX_TOKENS above {config.max_tokens}"
            raise LanguageModelError("truncated", f"language model {config.model}: the reply is cut off; {remedy}")
        if not (said.content or "").strip():
            what = "calls a tool, and none is offered" if said.tool_calls else "is empty"
            raise LanguageModelError("empty", f"language model {config.model}: the reply {what}; ask again")
        # Half a surrogate pair, which JSON can spell, is no text and could not be written to a file.
        return str(said.content).encode("utf-8", "replace").decode("utf-8")


def validated(text: str, answer: type[Answer], where: str) -> Answer:
    """Return the answer in a reply's text; `where` ends the message of the error.

    Raises:
        LanguageModelError: the text is no JSON, or not of that shape.
    """
    try:
        return answer.model_validate(parse_json(_unfenced(text).encode("utf-8"), "reply"))
    except ValidationError as error:
        problem = str(document_error("reply", error))
    except DocumentError as error:
        problem = str(error)
    remedy = f"ask again, or choose a model that keeps to a schema{where}"
    raise LanguageModelError("malformed", f"language model: {problem}; {remedy}", text) from None


def _unfenced(text: str) -> str:
    """Return the inside of a Markdown code block where the text is one; models without JSON mode write so."""
    lines = text.strip().splitlines()
    if len(lines) > 2 and lines[0].strip() in ("```", "```json") and lines[-1].strip() == "```":
        return "\n".join(lines[1:-1])
    return text
