"""Training sets for learned planners: frames, goals, expert paths and privileged maps of generated layouts."""

from labgym.policies.data.manifest import DataOptions, DatasetManifest, load_manifest
from labgym.policies.data.read import Dataset, load_dataset
from labgym.policies.data.shard import make_dataset

__all__ = ["DataOptions", "Dataset", "DatasetManifest", "load_dataset", "load_manifest", "make_dataset"]
