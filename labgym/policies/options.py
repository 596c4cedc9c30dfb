"""Options of policies and of their training, validated, with errors that list the valid names."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Self

from pydantic import Field, ValidationError

from labgym.counts import MAX_COUNT, MAX_PROCESSES
from labgym.documents import Record
from labgym.errors import OptionError, UnknownArgumentError

Count = Annotated[int, Field(ge=1, le=MAX_COUNT)]
Positive = Annotated[float, Field(gt=0.0)]
NonNegative = Annotated[float, Field(ge=0.0)]
Share = Annotated[float, Field(ge=0.0, le=1.0)]


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


class TrainOptions(Record):
    """Options that all planners are trained with.

    Attributes:
        epochs: passes over the training samples.
        batch: samples per gradient step.
        rate, decay: learning rate and weight decay of AdamW.
        held_out: share of the layouts, the last ones, that is used for validation and not trained on.
        samples: number of samples of the dataset to use; None uses all.
        threads: torch threads; the last bits of the weights depend on it.
        seed: random seed of the initial weights, the sample order, mirroring and noise.
    """

    epochs: Count
    batch: Count
    rate: Positive
    decay: NonNegative = 1e-3
    held_out: Annotated[float, Field(ge=0.0, lt=1.0)]
    samples: Count | None = None
    threads: Annotated[int, Field(ge=1, le=MAX_PROCESSES)] = 1
    seed: Annotated[int, Field(ge=0, lt=2**53)] = 0
