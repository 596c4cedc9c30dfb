"""The client: asks a language model for an answer of a given shape, and counts what that takes."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from types import TracebackType
from typing import TYPE_CHECKING, Generic, Self

from pydantic import ValidationError

from labgym.documents import document_error, parse_json
from labgym.errors import DocumentError, MissingDependencyError
from labgym.llm.completion import Answer, Completion, validated
from labgym.llm.config import LanguageModelConfig
from labgym.llm.dialect import Dialect
from labgym.llm.errors import LanguageModelError
from labgym.llm.messages import Message, Request
from labgym.llm.replay import RecordedReply, ReplayCache

if TYPE_CHECKING:
    from labgym.llm.endpoint import Endpoint


@dataclass(frozen=True)
class Usage:
    """What questions took.

    Attributes:
        asked: replies that the server gave. replayed: replies taken from the folder of recorded ones.
        tokens_in, tokens_out: read and written by the model, as the server counted them; replays take none.
        cost: US dollars; None where the configuration has no prices.
    """

    asked: int = 0
    replayed: int = 0
    tokens_in: int = 0
    tokens_out: int = 0
    cost: float | None = None

    def since(self, before: Usage) -> Usage:
        """Return what was taken since an earlier count."""
        cost = None if self.cost is None else self.cost - (before.cost or 0.0)
        return Usage(
            self.asked - before.asked,
            self.replayed - before.replayed,
            self.tokens_in - before.tokens_in,
            self.tokens_out - before.tokens_out,
            cost,
        )

    def __str__(self) -> str:
        price = "" if self.cost is None else f", {self.cost:.4f} USD"
        return (
            f"{self.asked} replies asked, {self.replayed} replayed, "
            f"{self.tokens_in} tokens read, {self.tokens_out} written{price}"
        )


@dataclass(frozen=True)
class Reply(Generic[Answer]):
    """An answer and where it comes from.

    Attributes:
        answer: validated.
        text: what the model said, to be put into a further question.
        key: SHA-256 of the request. replayed: whether it was on disk.
    """

    answer: Answer
    text: str
    key: str
    model: str
    prompt: str
    replayed: bool


class LanguageModel:
    """A client of one OpenAI-compatible endpoint.

    The server is asked for JSON by a schema; where it cannot do that, for JSON with the schema in the text. Either way
    the reply is validated here. No tool is ever offered, so a reply is data and nothing else.

    Args:
        config: which model, and within what bounds.
        sleep: waits the given seconds between two tries.
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
            raise LanguageModelError("not_configured", "replay has no folder to read from: set LABGYM_LLM_CACHE")

    @classmethod
    def from_environment(cls) -> Self:
        """Return a client of what the environment configures.

        Raises:
            LanguageModelError: nothing is configured.
            DocumentError: a variable is out of order.
        """
        return cls(LanguageModelConfig.from_environment())

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the connections; the client opens new ones when asked again."""
        if self._endpoint is not None:
            self._endpoint.close()
            self._endpoint = None

    @property
    def usage(self) -> Usage:
        """What all questions so far took."""
        return self._usage

    def ask(self, prompt: str, messages: tuple[Message, ...], answer: type[Answer]) -> Reply[Answer]:
        """Return the model's answer.

        Args:
            prompt: name and version of the prompt, such as annotate-asset/1; a part of what a recording is found by.
            messages: the conversation so far.
            answer: the model that the reply has to satisfy.

        Raises:
            LanguageModelError: no reply, or none that satisfies `answer`.
            DocumentError: a damaged recording.
            MissingDependencyError: the package openai is not installed.
        """
        request = Request(prompt, messages, answer)
        key = request.key(self.config)
        recorded = self._cache.get(key) if self._cache is not None else None
        replayed = recorded is not None
        if recorded is None:
            recorded = self._asked(request, key)
        else:
            self._count(Usage(replayed=1))
        where = f"; it is recorded in {self._cache.path(key)}" if self._cache is not None else ""
        return Reply(validated(recorded.text, answer, where), recorded.text, key, recorded.model, prompt, replayed)

    def _asked(self, request: Request, key: str) -> RecordedReply:
        if self.config.replay:
            assert self._cache is not None
            raise LanguageModelError(
                "not_recorded",
                f"no reply to request {key[:16]} (prompt {request.prompt}, model {self.config.model}) is recorded in "
                f"{self._cache.folder}; unset LABGYM_LLM_REPLAY to ask the server",
            )
        completion = self._completion(request)
        tokens = completion.tokens
        cost = (tokens.prompt_tokens * (self.config.price_in or 0.0)) / 1e6
        cost += (tokens.completion_tokens * (self.config.price_out or 0.0)) / 1e6
        self._count(Usage(1, 0, tokens.prompt_tokens, tokens.completion_tokens, cost))
        recorded = RecordedReply(
            request=key,
            prompt=request.prompt,
            model=self.config.model,
            text=self._connected().redacted(completion.text(self.config)),
            tokens_in=tokens.prompt_tokens,
            tokens_out=tokens.completion_tokens,
        )
        if self._cache is not None:
            self._cache.put(recorded)
        return recorded

    def _completion(self, request: Request) -> Completion:
        endpoint = self._connected()
        while True:
            try:
                raw = endpoint.complete(self._dialect.body(request, self.config))
                break
            except LanguageModelError as error:
                if error.reason != "rejected" or not self._dialect.adapt(str(error)):
                    raise
        try:
            return Completion.model_validate(parse_json(raw, self.config.base_url))
        except (DocumentError, ValidationError) as error:
            problem = str(error if isinstance(error, DocumentError) else document_error(self.config.base_url, error))
            remedy = "check that LABGYM_LLM_BASE_URL is an OpenAI-compatible API"
            told = endpoint.redacted(f"language model: no chat completion: {problem}; {remedy}")
            raise LanguageModelError("malformed", told) from None

    def _connected(self) -> Endpoint:
        if self._endpoint is None:
            try:
                from labgym.llm.endpoint import Endpoint
            except ModuleNotFoundError:
                raise MissingDependencyError("openai", "a language model", "llm") from None
            self._endpoint = Endpoint(self.config, self._sleep)
        return self._endpoint

    def _count(self, more: Usage) -> None:
        total = self._usage
        self._usage = Usage(
            total.asked + more.asked,
            total.replayed + more.replayed,
            total.tokens_in + more.tokens_in,
            total.tokens_out + more.tokens_out,
            None if total.cost is None else total.cost + (more.cost or 0.0),
        )
