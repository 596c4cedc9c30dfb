"""Long runs as independent shards: identity, ledger, executors, resume and provenance; it knows nothing of layouts."""

from labgym.runs.blobs import Blob
from labgym.runs.executors import ExecutorOptions, open_executor
from labgym.runs.folder import RunFolder
from labgym.runs.identity import RunIdentity, code_digest
from labgym.runs.provenance import RunProvenance, provenance
from labgym.runs.shards import Shard, ShardOutput, run_shards

__all__ = [
    "Blob",
    "ExecutorOptions",
    "RunFolder",
    "RunIdentity",
    "RunProvenance",
    "Shard",
    "ShardOutput",
    "code_digest",
    "open_executor",
    "provenance",
    "run_shards",
]
