"""The client: asks a language model for a structured answer, in the dialect of its server, and counts what it uses."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from types import TracebackType
from typing import TYPE_CHECKING, Generic, Self

from pydantic import ValidationError

from labgym.documents import document_error, parse_json
from labgym.errors import DocumentError, optional_package
from labgym.llm.completion import Answer, Completion, validated
from labgym.llm.config import LanguageModelConfig
from labgym.llm.errors import LanguageModelError
from labgym.llm.messages import Message, Question
from labgym.llm.replay import MAX_REPLY, RecordedReply, ReplayCache

if TYPE_CHECKING:
    from labgym.llm.endpoint import Endpoint
import json
from typing import Any

from labgym.llm.messages import is_strict


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


@dataclass(frozen=True)
class Usage:
    """Usage of a client.

    Attributes:
        requested: replies from the server. replayed: replies from the folder of recorded replies.
        tokens_in, tokens_out: tokens read and written by the model, as counted by the server; replays count none.
        cost: US dollars; None if the configuration has no prices.
    """

    requested: int = 0
    replayed: int = 0
    tokens_in: int = 0
    tokens_out: int = 0
    cost: float | None = None

    def since(self, before: Usage) -> Usage:
        """Return the usage since an earlier count."""
        cost = None if self.cost is None else self.cost - (before.cost or 0.0)
        return Usage(
            self.requested - before.requested,
            self.replayed - before.replayed,
            self.tokens_in - before.tokens_in,
            self.tokens_out - before.tokens_out,
            cost,
        )

    def __str__(self) -> str:
        price = "" if self.cost is None else f", {self.cost:.4f} USD"
        return (
            f"{self.requested} replies requested, {self.replayed} replayed, "
            f"{self.tokens_in} tokens read, {self.tokens_out} written{price}"
        )


@dataclass(frozen=True)
class Reply(Generic[Answer]):
    """An answer and its origin.

    Attributes:
        answer: the validated answer.
        text: the reply's text, for use in a further question.
        key: SHA-256 of the request.
        model, prompt: the model, and the prompt's name and version.
        replayed: whether the reply was recorded on disk.
    """

    answer: Answer
    text: str
    key: str
    model: str
    prompt: str
    replayed: bool


class LanguageModel:
    """A client of one OpenAI-compatible endpoint.

    The client requests JSON with a schema; if the server does not support that, JSON with the schema in the text. The
    reply is validated in either case. No tools are offered, so a reply is only data.

    Args:
        config: the model and its limits.
        sleep: function that waits a number of seconds between two attempts.
    """

    def __init__(self, config: LanguageModelConfig, sleep: Callable[[float], None] = time.sleep) -> None:
        self.config = config
        self._sleep = sleep
        self._cache = ReplayCache(config.cache) if config.cache is not None else None
        self._endpoint: Endpoint | None = None
        self._dialect = Dialect()
        free = None if config.price_in is None and config.price_out is None else 0.0
        self._usage = Usage(cost=free)
        if config.replay and self._cache is None:
            raise LanguageModelError(
                "not_configured", "replay needs a folder of recorded replies: set LABGYM_LLM_CACHE"
            )

    @classmethod
    def from_environment(cls) -> Self:
        """Return a client with the configuration in the environment variables.

        Raises:
            LanguageModelError: no model is configured.
            DocumentError: a variable has an invalid value.
        """
        return cls(LanguageModelConfig.from_environment())

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the connections; the next question opens new ones."""
        if self._endpoint is not None:
            self._endpoint.close()
            self._endpoint = None

    @property
    def usage(self) -> Usage:
        """Usage by all questions so far."""
        return self._usage

    def ask(
        self,
        prompt: str,
        messages: tuple[Message, ...],
        answer: type[Answer],
        seed: int | None = None,
        temperature: float | None = None,
    ) -> Reply[Answer]:
        """Return the model's answer.

        Args:
            prompt: name and version of the prompt, such as annotate-asset/1; part of the key of a recorded reply.
            messages: the conversation so far.
            answer: the pydantic model of the answer.
            seed, temperature: in place of those of the configuration; part of the key of a recorded reply.

        Raises:
            LanguageModelError: no reply, or a reply that does not satisfy `answer`.
            DocumentError: a recorded reply is damaged.
            MissingDependencyError: the package openai is not installed.
        """
        request = Question(prompt, messages, answer)
        changes = {"seed": seed, "temperature": temperature}
        config = self.config.model_copy(update={name: new for name, new in changes.items() if new is not None})
        key = request.key(config)
        recorded = self._cache.get(key) if self._cache is not None else None
        replayed = recorded is not None
        if recorded is None:
            recorded = self._asked(request, key, config)
        else:
            self._count(Usage(replayed=1))
        where = f"; it is recorded in {self._cache.path(key)}" if self._cache is not None else ""
        return Reply(validated(recorded.text, answer, where), recorded.text, key, recorded.model, prompt, replayed)

    def _asked(self, request: Question, key: str, config: LanguageModelConfig) -> RecordedReply:
        if self.config.replay:
            assert self._cache is not None
            raise LanguageModelError(
                "not_recorded",
                f"no reply to request {key[:16]} (prompt {request.prompt}, model {self.config.model}) is recorded in "
                f"{self._cache.folder}; unset LABGYM_LLM_REPLAY to ask the server",
            )
        completion = self._completion(request, config)
        tokens = completion.tokens
        cost = (tokens.prompt_tokens * (self.config.price_in or 0.0)) / 1e6
        cost += (tokens.completion_tokens * (self.config.price_out or 0.0)) / 1e6
        self._count(Usage(1, 0, tokens.prompt_tokens, tokens.completion_tokens, cost))
        text = self._connected().redacted(completion.text(config))
        if len(text) > MAX_REPLY:
            what = f"the reply has {len(text)} characters; at most {MAX_REPLY} are read"
            raise LanguageModelError("oversize", f"language model {config.model}: {what}; lower LABGYM_LLM_MAX_TOKENS")
        recorded = RecordedReply(
            request=key,
            prompt=request.prompt,
            model=config.model,
            text=text,
            tokens_in=tokens.prompt_tokens,
            tokens_out=tokens.completion_tokens,
        )
        if self._cache is not None:
            self._cache.put(recorded)
        return recorded

    def _completion(self, request: Question, config: LanguageModelConfig) -> Completion:
        endpoint = self._connected()
        while True:
            try:
                raw = endpoint.complete(self._dialect.body(request, config))
                break
            except LanguageModelError as error:
                if error.reason != "rejected" or not self._dialect.adapt(str(error)):
                    raise
        try:
            return Completion.model_validate(parse_json(raw, self.config.base_url))
        except (DocumentError, ValidationError) as error:
            problem = str(error if isinstance(error, DocumentError) else document_error(self.config.base_url, error))
        # Outside of the `except` block: the context of the error would hold the reply, which may repeat the key.
        remedy = "check that LABGYM_LLM_BASE_URL is an OpenAI-compatible API"
        raise LanguageModelError(
            "malformed", endpoint.redacted(f"language model: no chat completion: {problem}; {remedy}")
        )

    def _connected(self) -> Endpoint:
        if self._endpoint is None:
            with optional_package("openai", "a language model", "llm"):
                from labgym.llm.endpoint import Endpoint
            self._endpoint = Endpoint(self.config, self._sleep)
        return self._endpoint

    def _count(self, more: Usage) -> None:
        total = self._usage
        self._usage = Usage(
            total.requested + more.requested,
            total.replayed + more.replayed,
            total.tokens_in + more.tokens_in,
            total.tokens_out + more.tokens_out,
            None if total.cost is None else total.cost + (more.cost or 0.0),
        )
