"""Suites of floors: their layouts and drives, written to a folder that `labgym eval` reads."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import labgym
from labgym.documents import canonical_hash, json_bytes
from labgym.errors import OptionError, UnknownNameError
from labgym.layouts import Layout
from labgym.layouts.drives import floor_drives
from labgym.layouts.generate import FURNISHER
from labgym.layouts.places import (
    FIRST_SEEDS,
    LAST_DEVELOPMENT_SEED,
    PLACES,
    check_numbers,
    furnished,
    furnished_with,
)
from labgym.layouts.sealed import SECRET_SPLITS, Commitment, SealedFloor, sealed_seeds, secret_hash
from labgym.runs import ExecutorOptions, RunFolder, RunIdentity, Shard, ShardOutput, run_shards
from labgym.runs.folder import SHARDS
from labgym.suites import Suite, SuiteDrive

KIND = "floors"
SUITE_FILE = "suite.json"
MAX_STEPS = 1500
"""Control steps of an episode: at half of the robot's greatest speed it drives 75 m in this time."""
EPISODES = 12
"""Greatest number of drives of each floor."""


def floor_suite(
    split: str,
    count: int,
    out: str | Path,
    first: int = 0,
    episodes: int = EPISODES,
    seed: int | None = None,
    *,
    secret: bytes | None = None,
    executor: ExecutorOptions | None = None,
    fresh: bool = False,
    progress: bool = True,
) -> Suite:
    """Write floors of a split and a suite of their drives into a folder; return the suite.

    The folder receives `suite.json` and `layouts/`. An interrupted call resumes; the files do not depend on the
    executor.

    Args:
        split: floors-train, floors-val, floors-seen, floors-test, or floors-sealed or floors-fresh with its secret.
        count: number of floors, 1 to 10,000.
        out: the folder.
        first: place of the first floor in the split.
        episodes: greatest number of drives of each floor, 1 to 1000.
        seed: first development seed, below 10^9; None for the split's own seeds.
        secret: 32 bytes from which the seeds of these two follow; None for the other splits.
        executor: where the floors are made.
        fresh: move the files of the folder aside and start anew.
        progress: whether to show a progress bar.

    Raises:
        UnknownNameError: there is no such split.
        OptionError: a number is out of range, the secret is missing or not expected, or the folder holds something
            else.
        InfeasibleError: no seed of a place gives a layout.
        LabgymError: workers died.
    """
    limits = {
        "count": (count, 1, 10_000),
        "first": (first, 0, PLACES - 10_000),
        "episodes": (episodes, 1, 1000),
        "seed": (seed or 0, 0, LAST_DEVELOPMENT_SEED),
    }
    check_numbers(limits)
    if split not in FIRST_SEEDS and split not in SECRET_SPLITS:
        raise UnknownNameError("split of floors", split, (*FIRST_SEEDS, *SECRET_SPLITS))
    if (split in SECRET_SPLITS) != (secret is not None) or (secret is not None and seed is not None):
        raise OptionError(
            f"split {split!r}: the seeds of {' and '.join(SECRET_SPLITS)} follow from a secret (--secret-file), those "
            "of the other splits from --development or from the split"
        )
    inputs = {"split": split, "count": count, "first": first, "episodes": episodes, "seed": seed}
    inputs |= {} if secret is None else {"secret": secret_hash(secret)}
    with RunFolder.open(out, RunIdentity.of(KIND, **inputs), fresh) as folder:
        if folder.finished:
            return Suite.load(folder.path / SUITE_FILE)
        places = range(first, first + count)
        shards = [Shard(f"{index:05d}", make_floor, (split, index, seed, episodes, secret)) for index in places]
        done = {
            shard.name: json.loads(output.files[f"{SHARDS}/{shard.name}.json"])
            for shard, output in run_shards(
                shards, folder, executor or ExecutorOptions(), KIND, "floor", progress=progress
            )
        }
        floors = [done[shard.name] for shard in shards]
        suite = Suite(
            name=split,
            description=f"Drives on {count} floors of the split {split}.",
            layouts=tuple(floor["layout"]["id"] for floor in floors),
            drives={
                floor["layout"]["id"]: tuple(SuiteDrive.model_validate(drive) for drive in floor["drives"])
                for floor in floors
            },
            max_steps=MAX_STEPS,
        )
        files = {f"layouts/{floor['layout']['id']}.json": json_bytes(floor["layout"]) for floor in floors}
        folder.finish({**files, SUITE_FILE: json_bytes(suite.to_json())})
    return suite


def suite_floors(suite: Suite, out: str | Path) -> tuple[Layout, ...]:
    """Return the floors of a suite from the folder that `floor_suite` wrote.

    Raises:
        DocumentError: a file is missing or broken.
    """
    return tuple(Layout.load(Path(out) / "layouts" / f"{name}.json") for name in suite.layouts or ())


def commitment_to(secret: bytes, suite: Suite, floors: Sequence[Layout]) -> Commitment:
    """Return the commitment to sealed floors and to the suite of their drives, made by this version."""
    return Commitment(
        secret=secret_hash(secret),
        furnisher=FURNISHER,
        labgym=labgym.__version__,
        floors=tuple(SealedFloor(id=layout.id, hash=layout.hash) for layout in floors),
        suite=canonical_hash(suite.to_json()),
    )


def make_floor(split: str, index: int, first: int | None, episodes: int, secret: bytes | None = None) -> ShardOutput:
    """Return the layout at a place of a split, and its drives.

    Args:
        split, index, first: the place, as for `furnished`.
        episodes: greatest number of drives.
        secret: of a split whose seeds follow from one.

    Raises:
        InfeasibleError: no seed of the place gives a layout.
    """
    if secret is None:
        place, _, layout = furnished(split, index, first)
    else:
        place, _, layout = furnished_with(split, index, sealed_seeds(secret, index))
    drives = [SuiteDrive.of(one.pair) for one in floor_drives(layout, place.seed, episodes) if one.accepted]
    record = {"layout": layout.to_json(), "drives": [drive.model_dump(mode="json") for drive in drives]}
    return ShardOutput({f"{SHARDS}/{index:05d}.json": json.dumps(record, allow_nan=False).encode()})
