"""Which language model is asked, and within what bounds."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Self

from pydantic import Field, SecretStr, ValidationError

from labgym.documents import Record, document_error
from labgym.llm.errors import LanguageModelError

PREFIX = "LABGYM_LLM_"
NO_KEY = "none"
"""Sent where no key is given: servers of one's own want none, and the client wants a text."""


class LanguageModelConfig(Record):
    """An OpenAI-compatible endpoint and how to use it.

    Attributes:
        base_url: the API's root, such as http://127.0.0.1:8000/v1.
        api_key: sent to that address alone; in no file, log or message.
        timeout: seconds for one try, from the request to the last byte of the reply.
        retries: further tries after a lost connection, a time-out, a rate limit or a server's failure.
        max_tokens: length of a reply at most.
        temperature: 0 for the likeliest answer. seed: sent along; servers that know it repeat themselves.
        price_in, price_out: US dollars for a million tokens read and written; None where not known.
        cache: folder of recorded replies, or None to record nothing.
        replay: answer from the folder alone and never open a connection.
    """

    base_url: Annotated[str, Field(pattern=r"^https?://[^\s/@?#]+(/[^\s@?#]*)?$")]
    model: Annotated[str, Field(min_length=1, max_length=200)]
    api_key: SecretStr = SecretStr(NO_KEY)
    timeout: Annotated[float, Field(gt=0.0, le=3600.0)] = 60.0
    retries: Annotated[int, Field(ge=0, le=10)] = 2
    max_tokens: Annotated[int, Field(ge=1, le=1_000_000)] = 8192
    temperature: Annotated[float, Field(ge=0.0, le=2.0)] = 0.0
    seed: Annotated[int, Field(ge=0, le=2**31 - 1)] = 0
    price_in: Annotated[float, Field(ge=0.0, le=1e6)] | None = None
    price_out: Annotated[float, Field(ge=0.0, le=1e6)] | None = None
    cache: Path | None = None
    replay: bool = False

    @classmethod
    def from_environment(cls, environment: Mapping[str, str] = os.environ) -> Self:
        """Read LABGYM_LLM_BASE_URL, LABGYM_LLM_MODEL and, for each further attribute, LABGYM_LLM_<ATTRIBUTE>.

        Raises:
            LanguageModelError: base URL or model is missing (reason not_configured).
            DocumentError: a variable that cannot be what it should be; named without its value.
        """
        given = {name: environment.get(PREFIX + name.upper(), "").strip() for name in cls.model_fields}
        missing = [PREFIX + name.upper() for name in ("base_url", "model") if not given[name]]
        if missing:
            raise LanguageModelError(
                "not_configured",
                f"no language model is configured: set {' and '.join(missing)}"
                f" (and {PREFIX}API_KEY where the server wants a key)",
            )
        try:
            return cls.model_validate({name: value for name, value in given.items() if value})
        except ValidationError as error:
            raise document_error("environment", _without_values(error)) from None

    @classmethod
    def configured(cls, environment: Mapping[str, str] = os.environ) -> bool:
        """Tell whether the environment names an endpoint and a model."""
        return all(environment.get(PREFIX + name, "").strip() for name in ("BASE_URL", "MODEL"))


def _without_values(error: ValidationError) -> ValidationError:
    """Return the report with the values taken out: one of them might be the key put into the wrong variable."""
    lines = [
        {"type": line["type"], "loc": (PREFIX + str(line["loc"][0]).upper(),), "ctx": line.get("ctx", {}), "input": {}}
        for line in error.errors(include_url=False, include_input=False)
    ]
    return ValidationError.from_exception_data(error.title, lines)  # type: ignore[arg-type]
