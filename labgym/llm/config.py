"""Configuration of the language model and its limits."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import Field, SecretStr, ValidationError
from pydantic_core import PydanticCustomError

from labgym.documents import Record, document_error
from labgym.llm.errors import LanguageModelError

PREFIX = "LABGYM_LLM_"
NO_KEY = "none"
"""Sent if there is no key: local servers need none, but the client requires a string."""


class LanguageModelConfig(Record):
    """An OpenAI-compatible endpoint and how to use it.

    Attributes:
        base_url: the API's root, such as http://127.0.0.1:8000/v1.
        model: name of the model.
        api_key: sent only to that address; never written to a file, log or message.
        timeout: seconds per attempt, from the request to the last byte of the reply.
        retries: further attempts after a lost connection, a timeout, a rate limit or a server error.
        max_tokens: maximum length of a reply.
        temperature: 0 for the most likely answer. seed: random seed, used by servers that support it.
        price_in, price_out: US dollars per million tokens read and written; None if unknown.
        cache: folder of recorded replies; None records nothing.
        replay: whether to answer only from the folder, without opening a connection.
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
            DocumentError: a variable has an invalid value, which is not printed.
        """
        values = {name: environment.get(PREFIX + name.upper(), "").strip() for name in cls.model_fields}
        missing = [PREFIX + name.upper() for name in ("base_url", "model") if not values[name]]
        if missing:
            raise LanguageModelError(
                "not_configured",
                f"no language model is configured: set {' and '.join(missing)}"
                f" (and {PREFIX}API_KEY if the server requires a key)",
            )
        try:
            return cls.model_validate({name: value for name, value in values.items() if value})
        except ValidationError as error:
            problem = document_error("environment", _without_values(error))
        raise problem  # Outside of the `except` block: the context of the error would hold the values.

    @classmethod
    def configured(cls, environment: Mapping[str, str] = os.environ) -> bool:
        """Return whether the environment names an endpoint and a model."""
        return all(environment.get(PREFIX + name, "").strip() for name in ("BASE_URL", "MODEL"))


def _without_values(error: ValidationError) -> ValidationError:
    """Return the report without values, since one of them might be the key, put into the wrong variable."""
    lines = [
        {"type": _kind(line), "loc": (PREFIX + str(line["loc"][0]).upper(),), "ctx": line.get("ctx", {}), "input": {}}
        for line in error.errors(include_url=False, include_input=False)
    ]
    return ValidationError.from_exception_data(error.title, lines)  # type: ignore[arg-type]


def _kind(line: Any) -> str | PydanticCustomError:
    """Return the type of an error as pydantic accepts it: that of a path is one that it knows only itself."""
    if line["type"] == "path_type":
        return PydanticCustomError("path_type", "Input is not a valid path")
    return str(line["type"])
