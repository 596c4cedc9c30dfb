"""The policy of a shard: opened in a process of the worker that drives it."""

from __future__ import annotations

from dataclasses import dataclass

from labgym.documents import files_digest
from labgym.errors import LabgymError
from labgym.policies.kernels import kernel_mode
from labgym.policies.policy import Policy
from labgym.policies.process import PolicyProcess, PolicySource, ProcessLimits, shared_process
from labgym.runs.folder import SHARDS


@dataclass(frozen=True)
class ShardPolicy:
    """A policy as shards take it.

    Attributes:
        policy: for a separate process, or one that drives in this process.
        files: digest of the policy's files, such as weights, where the evaluation began.
        limits: of the policy's process. kernels: name of its kernel mode.
        label: name of the policy in the rows.
    """

    policy: PolicySource | Policy
    files: str
    limits: ProcessLimits | None
    kernels: str
    label: str

    def driver(self) -> PolicyProcess | Policy:
        """Return the policy in its process, or in this one.

        Raises:
            LabgymError: the policy's files are others here, or were changed; or this processor cannot run the kernels.
        """
        if not isinstance(self.policy, PolicySource):
            return self.policy
        return policy_process(self.policy, self.files, self.limits, self.kernels)


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
