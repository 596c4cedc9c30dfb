"""A submission of transitions, such as that of lab30, and the published suite that it must match."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from labgym.errors import UnknownNameError
from labgym.eval.driving.assignments import assignments, episode_keys
from labgym.eval.driving.drive import TransitionDrive, drive_episodes
from labgym.eval.driving.episode_row import TransitionRow
from labgym.eval.driving.evaluation import TransitionEvaluation
from labgym.eval.driving.files import SUMMARY
from labgym.eval.driving.record import NavigationSummary
from labgym.eval.driving.runner import catalog_digest
from labgym.eval.submission.claim import Claim
from labgym.eval.submission.record_checks import RunRecord, box_problems, catalog_problems, stated_problems
from labgym.policies import Policy
from labgym.policies.process import PolicyProcess
from labgym.runs.identity import IDENTITY_FILE
from labgym.suites import Suite, load_suite, suite_names


class TransitionClaim(Claim[NavigationSummary, TransitionRow]):
    """A submission of transitions, and the published suite with its repeats and its jitter.

    Args:
        folder: of the submission. suite: name or .json file of the suite, if not that of the submission's name.

    Raises:
        DocumentError, UnknownNameError: the summary cannot be read, or there is no such suite.
    """

    def __init__(self, folder: Path, suite: str | None) -> None:
        summary = NavigationSummary.load(folder / SUMMARY)
        claimed = summary.suite
        published = load_suite(suite if suite is not None else _base_name(claimed.name))
        self._suite = published.repeated(claimed.repeats, claimed.jitter)
        self._layouts = {layout.id: layout for layout in self._suite.load_layouts()}
        self._episodes = {
            key: (layout, episode)
            for layout in self._layouts.values()
            for key, episode in zip(episode_keys(layout, self._suite), assignments(layout, self._suite), strict=True)
        }
        super().__init__(folder, summary, self._suite.label, list(self._episodes), TransitionRow)

    def identity_problems(self, record: RunRecord) -> Iterator[str]:
        """Yield a sentence for each input of the run that is not the summary's or the suite's."""
        identity, summary = record.identity, self.summary
        if identity is None:
            return
        expected = {
            "suite": summary.suite.model_dump(mode="json"),
            "layouts": summary.layouts,
            "seed": summary.seed,
            "policy": summary.policy,
        }
        yield from stated_problems(identity, TransitionEvaluation.KIND, expected)
        if identity.kind != TransitionEvaluation.KIND:
            return
        if identity.inputs.get("isolated") is not True:
            yield f"{IDENTITY_FILE}: the policy was not driven in a separate process"
        yield from box_problems(identity, summary.box)
        yield from catalog_problems(identity, catalog_digest(self._layouts.values()))

    def suite_problems(self) -> Iterator[str]:
        """Yield a sentence if the claimed suite differs from the published one."""
        claimed, published = self.summary.suite, self._suite
        names = [name for name in Suite.model_fields if getattr(claimed, name) != getattr(published, name)]
        if names:
            yield f"suite {claimed.label} differs from the published {published.label} in {', '.join(names)}"

    def summary_problems(self, record: RunRecord) -> Iterator[str]:
        """Yield a sentence for each part of the summary that does not match the rows or the published suite."""
        summary, count = self.summary, len(self.keys)
        hashes = {name: layout.hash for name, layout in self._layouts.items()}
        differing = [name for name in {**hashes, **summary.layouts} if hashes.get(name) != summary.layouts.get(name)]
        if differing:
            yield f"{SUMMARY}: other layouts than the published ones: {', '.join(name[:80] for name in differing[:5])}"
        if summary.expected != count:
            yield f"{SUMMARY}: expected is {summary.expected}, but the suite has {count} episodes"
        yield from super().summary_problems(record)

    def stated(self, driver: PolicyProcess) -> dict[str, tuple[object, object]]:
        """Return properties of the policy, and what the submission says of them."""
        return {
            "privileged": (driver.privileged, self.summary.privileged),
            "sensors": (driver.observation, self.summary.sensors),
        }

    def drive(self, driver: PolicyProcess | Policy, key: str, blind: bool = False) -> TransitionDrive:
        """Drive an episode again and return the results; see `Claim.drive`."""
        summary, (layout, episode) = self.summary, self._episodes[key]
        (drive,) = drive_episodes(driver, layout, (episode,), self._suite, summary.policy, summary.seed, blind=blind)
        return drive


def _base_name(name: str) -> str:
    """Return the name of the published suite of which a name such as test-5x-1a2b3c is a repetition."""
    names = [base for base in suite_names() if name == base or name.startswith(f"{base}-")]
    if not names:
        raise UnknownNameError("published suite", name, suite_names())
    return max(names, key=len)
