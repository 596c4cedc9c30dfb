"""The run of an evaluation: an open policy, the shards that it drives, and the files that they give."""

from __future__ import annotations

import contextlib
from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

from labgym.assets import Catalog
from labgym.documents import canonical_hash, files_digest, json_bytes
from labgym.errors import LabgymError, OptionError
from labgym.eval.driving.evaluation import Evaluation
from labgym.eval.driving.files import ACTIONS, EPISODES, ROUTES, SUMMARY, TIMES, short_name
from labgym.eval.driving.record import EvaluationSummary
from labgym.layouts import Layout
from labgym.layouts.sealed import SECRET
from labgym.policies import Policy
from labgym.policies.fingerprint.policy import PolicyFingerprint, named_fingerprint, object_fingerprint
from labgym.policies.kernels import NATIVE, KernelMode, kernel_facts, kernel_mode
from labgym.policies.process import PolicyProcess, PolicySource, ProcessLimits, close_shared_process, shared_process
from labgym.policies.process.box import BUILT_IN_CODE, NOT_BOXED
from labgym.policies.registry import SERVER, is_class_place, policy_place
from labgym.runs import ExecutorOptions, RunFolder, RunIdentity, Shard, run_shards
from labgym.runs.folder import SHARDS


@dataclass(frozen=True)
class ShardPolicy:
    """A policy as shards take it.

    Attributes:
        policy: for a separate process, or one that drives in this process.
        files: digest of the policy's files, such as weights, where the evaluation began.
        limits: of the policy's process. kernels: name of its kernel mode.
        label: name of the policy in the rows. box: level of the box where the evaluation began.
    """

    policy: PolicySource | Policy
    files: str
    limits: ProcessLimits | None
    kernels: str
    label: str
    box: str

    def driver(self) -> PolicyProcess | Policy:
        """Return the policy in its process, or in this one.

        Raises:
            LabgymError: the policy's files are others here, or were changed; this processor cannot run the kernels; or
                this kernel has another box.
        """
        if not isinstance(self.policy, PolicySource):
            return self.policy
        process = policy_process(self.policy, self.files, self.limits, self.kernels)
        if process.box != self.box:
            raise LabgymError(
                f"policy {self.label!r}: the box of this worker is {process.box!r}, that of the evaluation "
                f"{self.box!r}; drive on machines with one kernel"
            )
        return process


def policy_process(
    source: PolicySource, files: str, limits: ProcessLimits | None, kernels: str, most: int = 1
) -> PolicyProcess:
    """Return the process of a policy in this worker, which keeps `most` of them.

    Raises:
        LabgymError: the policy's files are not those of the digest.
    """
    process = shared_process(source, limits, kernel_mode(kernels).environment, most)
    # A pickled object contains the weights that it has read.
    if source.pickled is None and (own := files_digest(process.files())) != files:
        raise LabgymError(
            f"policy {source.name!r}: its files (digest {own[:12]}) are not those that the evaluation began with "
            f"({files[:12]}); install the same version of labgym, and do not change weights during an evaluation"
        )
    return process


def shard_file(shard: str, name: str) -> str:
    """Return the path of a file of a shard, relative to the folder of the evaluation."""
    return f"{SHARDS}/{shard}/{name}"


Content = dict[str, bytes]
"""Content of the files of an evaluation by name."""
FILES = (EPISODES, ROUTES, ACTIONS, TIMES)
E = TypeVar("E", bound=Evaluation[Any, Any])


@dataclass(frozen=True)
class RunningPolicy:
    """A policy that is open for an evaluation.

    Attributes:
        policy: as the user passed it. source: for processes. driver: the policy in its process, or in this one.
        label: name of the policy in the rows. limits: of its process. mode: its kernels. executor: where it drives.
    """

    policy: str | Policy
    source: PolicySource
    driver: Policy | PolicyProcess
    label: str
    limits: ProcessLimits | None
    mode: KernelMode
    executor: ExecutorOptions

    @property
    def isolated(self) -> bool:
        """Whether the policy drives in a separate process."""
        return isinstance(self.driver, PolicyProcess)

    @property
    def box(self) -> str:
        """Level of the box in which the policy drives (`labgym.policies.process.box`)."""
        if isinstance(self.driver, PolicyProcess):
            return self.driver.box
        return BUILT_IN_CODE if self.source.built_in else NOT_BOXED

    @property
    def shard_policy(self) -> ShardPolicy:
        """The policy as shards take it."""
        policy = self.driver if isinstance(self.driver, Policy) else self.source
        return ShardPolicy(policy, files_digest(self.driver.files()), self.limits, self.mode.kind, self.label, self.box)


@contextlib.contextmanager
def opened(
    policy: str | Policy,
    source: PolicySource,
    executor: ExecutorOptions,
    limits: ProcessLimits | None,
    kernels: str | None,
    isolated: bool = True,
) -> Iterator[RunningPolicy]:
    """Open a policy for an evaluation, and close it at the end.

    Args:
        policy, limits, kernels, isolated: as for `evaluate`. source: of the policy. executor: where shards are driven.

    Raises:
        OptionError: the executor does not suit the policy, or it is not isolated and the executor has workers.
    """
    mode, here = kernel_mode(kernels), executor == ExecutorOptions()
    if not isolated and not here:
        raise OptionError(f"isolated=False drives in this process; use workers=1, not {executor.workers}")
    with open_driver(policy, source, limits, mode, isolated) as driver:
        label = short_name(source.name) if isinstance(policy, str) and not is_class_place(policy) else driver.name
        if driver.exclusive and not here:
            raise OptionError(f"policy {label!r} drives one robot at a time; use the local executor with workers=1")
        if executor.kind == "dask":
            source = source.portable(driver.files())
        yield RunningPolicy(policy, source, driver, label, limits, mode if isolated else NATIVE, executor)


class EvaluationRun(ABC, Generic[E]):
    """An evaluation: its shards, and what they return.

    Args:
        running: the policy. shards: in the order of the suite. layouts: that are driven in. seed: of the policy.
    """

    evaluation: type[E]

    def __init__(self, running: RunningPolicy, shards: Sequence[Shard], layouts: Iterable[Layout], seed: int) -> None:
        self.running, self.shards, self.layouts, self.seed = running, tuple(shards), tuple(layouts), seed

    @abstractmethod
    def inputs(self) -> dict[str, Any]:
        """Return what identifies the evaluation besides policy, seed, kernels, limits and catalog."""

    @abstractmethod
    def summary(self, rows: tuple[Any, ...]) -> EvaluationSummary:
        """Return the summary of rows."""

    def documents(self) -> Content:
        """Return further files of the evaluation."""
        return {}

    def carried_out(self, out: str | Path | None, fresh: bool, progress: bool) -> E:
        """Drive the shards that the folder does not hold, write the files, and return the evaluation.

        Args:
            out: the folder; None writes nothing. fresh: move an existing folder aside. progress: show a progress bar.
        """
        running, driver = self.running, self.running.driver
        policy = (
            None if out is None else policy_fingerprint(running.policy, running.source, running.label, driver.files())
        )
        if running.executor != ExecutorOptions():
            close_shared_process()
        if out is None or policy is None:
            return self._evaluation(self._drive(None, progress), Path())
        identity = RunIdentity.of(
            self.evaluation.KIND,
            **self.inputs(),
            policy=policy.model_dump(),
            seed=self.seed,
            kernels=running.mode.name,
            box=running.box,
            limits=None if running.limits is None else running.limits.model_dump(),
            catalog=catalog_digest(self.layouts),
        )
        in_force = driver.kernels if isinstance(driver, PolicyProcess) else kernel_facts()
        with RunFolder.open(out, identity, fresh, in_force) as folder:
            if folder.finished:
                content = {name: (folder.path / name).read_bytes() for name in FILES}
                return self._evaluation(content, folder.path)
            content = self._drive(folder, progress)
            evaluation = self._evaluation(content, folder.path)
            files = {name: content[name] for name in (EPISODES, ROUTES, ACTIONS)}
            files[SUMMARY] = json_bytes(evaluation.summary.to_json())
            folder.finish(files | self.documents(), measured={TIMES: content[TIMES]})
            return evaluation

    def _evaluation(self, content: Content, folder: Path) -> E:
        evaluation: E = self.evaluation.of(content, self.summary, folder)
        return evaluation

    def _drive(self, folder: RunFolder | None, progress: bool) -> Content:
        """Drive the shards that the folder does not hold; return the content of its files in the suite's order."""
        guard, executor = {"catalog": installed_catalog}, self.running.executor
        finished = {
            shard.name: output.files
            for shard, output in run_shards(
                self.shards, folder, executor, self.running.label, "ep", guard, progress=progress
            )
        }
        return {
            name: b"".join(finished[shard.name][shard_file(shard.name, name)] for shard in self.shards)
            for name in FILES
        }


def installed_catalog() -> str:
    """Return the digest of the catalog of this installation."""
    return Catalog.load().digest


def catalog_digest(layouts: Iterable[Layout]) -> str:
    """Return the digest of the catalogs of layouts, as in the identity of an evaluation."""
    return canonical_hash(sorted({layout.catalog.digest for layout in layouts}))


def policy_fingerprint(
    policy: str | Policy, source: PolicySource, label: str, files: Sequence[Path]
) -> PolicyFingerprint:
    """Return the fingerprint of a policy, as in the identity of an evaluation.

    Args:
        policy: the name or the object.
        source: the same with its options.
        label: name of the policy in the rows.
        files: its files, such as weights, as its process states them.
    """
    if isinstance(policy, Policy):
        return object_fingerprint(policy, files)
    place = policy_place(policy)
    server = {"url": policy} if place == SERVER else {}
    return named_fingerprint(label, place, {**server, **source.options}, files)


def hidden_places(out: str | Path) -> tuple[str, ...]:
    """Return the folders that a policy must not read: that of its run, and the one with the secret of its floors."""
    folder = Path(out).resolve()
    return str(folder), *(str(parent) for parent in folder.parents if (parent / SECRET).is_file())


def policy_source(policy: str | Policy, options: dict[str, Any]) -> PolicySource:
    """Return the source of a policy for its process.

    Raises:
        OptionError: options for an object, or not a policy.
    """
    if isinstance(policy, Policy):
        if options:
            raise OptionError(f"options {sorted(options)} need a policy named by a string; a policy object takes none")
        return PolicySource.copied(policy)
    if not isinstance(policy, str):
        got = type(policy).__name__
        raise OptionError(
            f"policy: expected a name or a labgym.policies.Policy, got {got}; derive its class from Policy"
        )
    return PolicySource.named(policy, options)


@contextlib.contextmanager
def open_driver(
    policy: str | Policy, source: PolicySource, limits: ProcessLimits | None, mode: KernelMode, isolated: bool
) -> Iterator[Policy | PolicyProcess]:
    """Open the policy in a separate process or, not isolated, in this one, and close it at the end."""
    if isolated:
        try:
            yield shared_process(source, limits, mode.environment)
        finally:
            close_shared_process()
        return
    driver = policy if isinstance(policy, Policy) else source.make()
    try:
        yield driver
    finally:
        if driver is not policy:
            driver.close()
