"""The policy of a submission: which one drives again, and whether it is the one that the submission names."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from labgym.errors import OptionError
from labgym.eval.driving.record import EvaluationSummary
from labgym.eval.driving.runner import policy_fingerprint
from labgym.eval.submission.record_checks import RunRecord
from labgym.policies.process import PolicyProcess, PolicySource
from labgym.policies.registry import BUILT_IN


@dataclass(frozen=True)
class PolicyChoice:
    """The policy that drives again.

    Attributes:
        name: for `make_policy`.
        options: its arguments.
        passed: whether the user passed the policy; otherwise it is the built-in one that the submission names.
    """

    name: str
    options: dict[str, Any] = field(default_factory=dict)
    passed: bool = False

    @classmethod
    def of(cls, summary: EvaluationSummary, name: str | None, options: Mapping[str, Any] | None) -> PolicyChoice:
        """Return the policy that the user passed, or else the built-in one that a submission names.

        A submission cannot choose a class, a file or a server: only built-in names are taken from it, and only
        options that are numbers and switches.

        Raises:
            OptionError: the policy of the submission is not built in, or has options that are not taken from it.
        """
        remedy = "pass the policy with --policy and --options, or check without driving with --no-drive"
        if name is not None:
            if summary.options and not options:
                raise OptionError(
                    f"the submission drove with options {_shown(summary.options)}: pass them with --options"
                )
            return cls(name, dict(options or {}), passed=True)
        if summary.policy not in BUILT_IN:
            raise OptionError(f"policy {summary.policy[:80]!r} of the submission is not built in; {remedy}")
        unsafe = sorted(key for key, value in summary.options.items() if not _is_plain(value))
        if unsafe:
            raise OptionError(f"option {unsafe[0][:80]!r} of the submission is not a number or a switch; {remedy}")
        return cls(summary.policy, dict(summary.options))

    @property
    def source(self) -> PolicySource:
        """The policy, for a separate process."""
        return PolicySource.named(self.name, self.options)

    def problems(
        self, policy: PolicyProcess, stated: Mapping[str, tuple[object, object]], label: str, record: RunRecord
    ) -> Iterator[str]:
        """Yield a sentence for each way in which the policy is not the one that the submission names.

        Args:
            policy: in its process. stated: properties of it, and what the submission says of them.
            label: of the policy in the submission. record: of the run.
        """
        for name, (value, claimed) in stated.items():
            if value != claimed:
                yield f"{name} of the policy is {value!r}, the submission says {claimed!r}"
        if record.identity is None:
            return
        expected = policy_fingerprint(self.name, self.source, label, policy.files()).model_dump()
        stated_policy = record.identity.inputs.get("policy")
        differing = [
            name
            for name in expected
            if not isinstance(stated_policy, dict) or stated_policy.get(name) != expected[name]
        ]
        if differing:
            yield f"the policy's {', '.join(differing)} differ from those in the submission's identity"


def _is_plain(value: object) -> bool:
    """Return whether a value is a number, a switch, None, or a mapping of such values."""
    if isinstance(value, dict):
        return all(not isinstance(item, dict) and _is_plain(item) for item in value.values())
    return value is None or isinstance(value, bool | int | float)


def _shown(options: Mapping[str, Any]) -> str:
    return ", ".join(f"{key}={value}" for key, value in options.items())[:200]
