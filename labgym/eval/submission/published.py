"""The published suite that a submission must match, with its layouts and episodes."""

from __future__ import annotations

from dataclasses import dataclass

from labgym.errors import UnknownNameError
from labgym.eval.driving.assignments import episode_keys
from labgym.eval.driving.episode_row import Key
from labgym.eval.driving.runner import catalog_digest
from labgym.layouts import Layout
from labgym.suites import Suite, load_suite, suite_names


@dataclass(frozen=True)
class Published:
    """A suite of this installation.

    Attributes:
        suite: the suite, with the repeats and the jitter of the submission.
        layouts: its layouts by id, in order.
        keys: its episodes by layout id, in order.
    """

    suite: Suite
    layouts: dict[str, Layout]
    keys: dict[str, tuple[Key, ...]]

    @classmethod
    def of(cls, claimed: Suite, name: str | None = None) -> Published:
        """Return the published suite that a submission claims, repeated as the claimed one is.

        Args:
            claimed: the suite in the submission.
            name: name or .json file of the suite to use instead of the one that the claimed suite's name gives.

        Raises:
            UnknownNameError: no published suite has that name.
            DocumentError: the file is not a suite.
        """
        base = load_suite(name) if name is not None else load_suite(_base_name(claimed.name))
        suite = base.repeated(claimed.repeats, claimed.jitter)
        layouts = {layout.id: layout for layout in suite.load_layouts()}
        return cls(suite, layouts, {layout.id: episode_keys(layout, suite) for layout in layouts.values()})

    @property
    def catalog(self) -> str:
        """Digest of the layouts' catalogs, as in the identity of an evaluation."""
        return catalog_digest(self.layouts.values())

    @property
    def episodes(self) -> int:
        """Number of episodes."""
        return sum(map(len, self.keys.values()))


def suite_problems(claimed: Suite, published: Suite) -> list[str]:
    """Return a sentence if a suite differs from the published one."""
    names = [name for name in Suite.model_fields if getattr(claimed, name) != getattr(published, name)]
    return (
        [f"suite {claimed.label} differs from the published {published.label} in {', '.join(names)}"] if names else []
    )


def _base_name(name: str) -> str:
    """Return the name of the published suite of which a name such as test-5x-1a2b3c is a repetition."""
    names = [base for base in suite_names() if name == base or name.startswith(f"{base}-")]
    if not names:
        raise UnknownNameError("published suite", name, suite_names())
    return max(names, key=len)
