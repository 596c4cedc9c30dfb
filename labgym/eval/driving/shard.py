"""The shard of an evaluation: all episodes of one layout, driven in this process or in a worker."""

from __future__ import annotations

from labgym.documents import files_digest
from labgym.errors import LabgymError
from labgym.eval.driving.drive import drive_layout
from labgym.eval.driving.files import drive_files
from labgym.layouts import Layout
from labgym.policies.kernels import kernel_mode
from labgym.policies.policy import Driver
from labgym.policies.process import PolicyProcess, PolicySource, ProcessLimits, shared_process
from labgym.runs import ShardOutput
from labgym.runs.folder import SHARDS
from labgym.suites import Suite


def drive_shard(
    policy: PolicySource | Driver,
    files: str,
    limits: ProcessLimits | None,
    kernels: str,
    label: str,
    layout: Layout,
    suite: Suite,
    seed: int,
) -> ShardOutput:
    """Drive all episodes of a layout and return rows, routes and times, below `shards/LAYOUT/`.

    Args:
        policy: the policy, for a separate process, or a policy that drives in this process.
        files: digest of the policy's files, such as weights, where the evaluation began.
        limits: limits of the policy's process.
        kernels: name of its kernel mode.
        label: name of the policy in the rows.
        layout: the layout; its protocol gives the goal pairs.
        suite: the rules.
        seed: random seed of the evaluation.

    Raises:
        LabgymError: the policy's files are others here, or were changed; or this processor cannot run the kernels.
    """
    driver = policy_process(policy, files, limits, kernels) if isinstance(policy, PolicySource) else policy
    drives = drive_layout(driver, layout, suite, label, seed)
    return ShardOutput({shard_file(layout.id, name): content for name, content in drive_files(drives).items()})


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
