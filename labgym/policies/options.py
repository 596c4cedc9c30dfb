"""Options of policies: one contract for all, validated, with errors that list the valid names."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self

from pydantic import ValidationError

from labgym.documents import Record
from labgym.errors import OptionError, UnknownArgumentError


class PolicyOptions(Record):
    """Base of the options that tune a policy: named numbers with defaults and limits.

    Raises:
        UnknownArgumentError: an option does not exist; lists the valid ones.
        OptionError: a value is outside its limits.
    """

    def __init__(self, **values: Any) -> None:
        unknown = sorted(values.keys() - type(self).model_fields.keys())
        if unknown:
            raise UnknownArgumentError(type(self).__name__, unknown[0], type(self).model_fields)
        try:
            super().__init__(**values)
        except ValidationError as error:
            first = error.errors(include_url=False)[0]
            name = ".".join(str(part) for part in first["loc"])
            problem = " ".join(first["msg"].split()).replace("Input should", "it should")
            raise OptionError(f"{type(self).__name__}: {name} is {first['input']!r}; {problem}") from None

    @classmethod
    def of(cls, options: Self | Mapping[str, Any] | None) -> Self:
        """Return options from an instance, a mapping of those that differ from the defaults, or None for the defaults.

        Raises:
            UnknownArgumentError: an option does not exist; lists the valid ones.
            OptionError: a value is outside its limits, or `options` is none of these.
        """
        if isinstance(options, cls):
            return options
        if options is None:
            return cls()
        if isinstance(options, Mapping):
            return cls(**options)
        raise OptionError(
            f"options are a {type(options).__name__}; expected {cls.__name__} or a mapping of option names to values, "
            f"of: {', '.join(cls.model_fields)}"
        )
