"""The commands for splits of floors: write their floors, describe them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import arg
from tyro.extras import SubcommandApp

from labgym.cli.arguments import THIS_PROCESS, Execution, OptionalPath, OptionalWholeNumber
from labgym.cli.outcome import DONE, complaints, written

describe_app = SubcommandApp()

SplitName = Literal["floors-train", "floors-val", "floors-seen", "floors-test"]
SplitNames = Annotated[tuple[SplitName, ...], arg(metavar="SPLIT [SPLIT ...]")]


def floors(
    split: SplitName | Literal["floors-sealed"],
    out: Path,
    count: OptionalWholeNumber = None,
    first: int = 0,
    episodes: int = 12,
    development: OptionalWholeNumber = None,
    secret_file: OptionalPath = None,
    fresh: bool = False,
    execution: Execution = THIS_PROCESS,
) -> int:
    """Write floors of a split, and a suite of drives on them.

    OUT receives layouts/ and suite.json; labgym eval --suite OUT/suite.json --layouts OUT/layouts drives them.
    An interrupted command resumes. For floors-sealed, OUT receives commitment.json too; exit 1 if the floors or the
    suite do not have the hashes of the published commitment.

    Args:
        split: floors-train, floors-val and floors-seen have the families of training, floors-test has others
            (docs/splits.md); floors-sealed needs its secret.
        out: Folder.
        count: Number of floors; by default 10, and all of floors-sealed.
        first: Place of the first floor in the split.
        episodes: Greatest number of drives of each floor.
        development: First development seed, below 10^9, in place of the split's own. Tune on these alone.
        secret_file: File of the secret of floors-sealed: 64 hexadecimal digits.
        fresh: Move the files of the folder aside and start anew.
    """
    from labgym.eval.driving.floor_suites import commitment_to, floor_suite, suite_floors
    from labgym.layouts.sealed import COMMITMENT, SEALED, SEALED_FLOORS, commitment, read_secret

    secret = None if secret_file is None else read_secret(secret_file)
    if count is None:
        count = SEALED_FLOORS if split == SEALED else 10
    suite = floor_suite(split, count, out, first, episodes, development, secret, execution.options(), fresh)
    drives = sum(map(len, (suite.drives or {}).values()))
    print(f"{count} floors, {drives} drives")
    written(out)
    if secret is None:
        return DONE
    own, committed = commitment_to(secret, suite, suite_floors(suite, out)), commitment()
    written(own.save(out / COMMITMENT))
    if committed is None:
        print("No commitment is published; nothing was compared.")
        return DONE
    problems = committed.differences(own)
    if not problems:
        print(f"The secret, {len(own.floors)} floors and the suite have the hashes of the published commitment.")
    return complaints(problems)


@describe_app.command
def splits(
    split: SplitNames = ("floors-test",),
    floors: int = 91,
    episodes: int = 12,
    seed: int = 0,
    own: bool = False,
    published: bool = False,
    out: OptionalPath = None,
    fresh: bool = False,
    execution: Execution = THIS_PROCESS,
) -> int:
    """Draw floors of splits and their episodes, and print their figures and bars.

    For each family: floors, overlap of their furniture and walls of their hoods; over episodes and over all drives
    that were tried: length, detour, necks, and the shares that blind policies drive freely (docs/splits.md). With 91
    floors of each of three families it takes about ten minutes of CPU a split.

    Args:
        split: Names of splits (docs/splits.md).
        floors: Number of floors of each family. The blind policies know the furniture of up to 90 others of them.
        episodes: Number of episodes of each floor.
        seed: First development seed; the splits' own floors have others.
        own: Describe the splits' own floors. Do not tune anything on them.
        published: Describe the published floors of floors-val and floors-seen, or of floors-test: all of them.
        out: Folder for summary.json, floors.jsonl and drives.jsonl. An interrupted command with the same folder
            resumes.
        fresh: Move the files of the folder aside and start anew.
    """
    from labgym.eval.variety.describe import describe_splits
    from labgym.eval.variety.tables import tables

    description = describe_splits(
        split,
        floors,
        episodes,
        None if own else seed,
        out,
        executor=execution.options(),
        fresh=fresh,
        published=published,
    )
    for table in tables(description.summary):
        print(f"\n{table.text()}")
    print()
    return DONE if out is None else written(out)
