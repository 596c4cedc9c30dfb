"""The commands for splits of floors: write their floors, draw LabNav's suites on them, describe them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import arg

from labgym.cli.arguments import THIS_PROCESS, Execution, OptionalPath, OptionalWholeNumber
from labgym.cli.effects import refuses_idle_flags
from labgym.cli.outcome import DONE, complaints, written

SplitName = Literal["floors-train", "floors-val", "floors-seen", "floors-test"]
SplitNames = Annotated[tuple[SplitName, ...], arg(metavar="SPLIT [SPLIT ...]")]


def floors(
    split: SplitName | Literal["floors-sealed", "floors-fresh"],
    *,
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
            (docs/splits.md); floors-sealed needs its secret, floors-fresh that of a round.
        out: Folder.
        count: Number of floors; by default 10, and 60 of floors-sealed and floors-fresh.
        first: Place of the first floor in the split.
        episodes: Greatest number of drives of each floor.
        development: First development seed, below 10^9, in place of the split's own. Tune on these alone.
        secret_file: File of the secret of floors-sealed or floors-fresh: 64 hexadecimal digits.
        fresh: Move the files of the folder aside and start anew.
    """
    from labgym.eval.driving.floor_suites import commitment_to, floor_suite, suite_floors
    from labgym.layouts.sealed import (
        COMMITMENT,
        SEALED,
        SEALED_FLOORS,
        SECRET_SPLITS,
        commitment,
        read_secret,
    )

    secret = None if secret_file is None else read_secret(secret_file)
    if count is None:
        count = SEALED_FLOORS if split in SECRET_SPLITS else 10
    suite = floor_suite(
        split, count, out, first, episodes, development, secret=secret, executor=execution.options(), fresh=fresh
    )
    drives = sum(map(len, (suite.drives or {}).values()))
    print(f"{count} floors, {drives} drives")
    written(out)
    if secret is None or split != SEALED:
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


@refuses_idle_flags("labnav")
def labnav(
    split: Literal["floors-val", "floors-seen", "floors-test", "floors-sealed", "floors-fresh"],
    *,
    out: Path,
    floors: int = 60,
    episodes: int = 2,
    tasks: Annotated[tuple[str, ...], arg(metavar="TASK [TASK ...]", help_behavior_hint="")] = (),
    level: Annotated[tuple[Literal[1, 2, 3], ...], arg(metavar="LEVEL [LEVEL ...]")] = (1, 2, 3),
    version: int = 2,
    draft: bool = False,
    unfiltered: bool = True,
    seed: int = 14,
    secret_file: OptionalPath = None,
    layouts: OptionalPath = None,
    publish: bool = False,
    fresh: bool = False,
    execution: Execution = THIS_PROCESS,
) -> int:
    """Draw the suites of LabNav on the floors of a split.

    OUT receives TASK-LEVEL.json for each task and level, TASK-2-unfiltered.json with all drives that have a path, and
    suites.json with their hashes (docs/labnav.md). An interrupted command resumes. With floors-sealed, exit 1 if the
    suites do not have the hashes of the published sealed.json.

    Args:
        split: floors-test for the benchmark; floors-val for development.
        out: Folder.
        floors: Number of floors of each suite; fewer if the split has no more with enough episodes.
        episodes: Number of episodes of each floor.
        tasks: Names of tasks; by default all.
        level: Levels.
        version: Version of the suites; 0 for drafts.
        draft: Mark the suites as drafts.
        unfiltered: Draw the unfiltered suites of level 2, too: one episode a floor.
        seed: Random seed of the draw.
        secret_file: File of the secret of floors-sealed or floors-fresh: 64 hexadecimal digits.
        layouts: Folder of the floors of either: OUT/layouts of labgym floors.
        publish: Copy the suites to eval/labnav, those on floors-val to its folder val; of the sealed ones the hashes
            alone, as sealed.json.
        fresh: Move the files of the folder aside and start anew.
    """
    from labgym.envs.labnav.tasks import TASKS
    from labgym.eval.labnav.publication import SEALED_MANIFEST, Publication, draw_suites, published_manifest
    from labgym.eval.labnav.publication import publish as publish_suites
    from labgym.layouts.sealed import SEALED, read_secret

    publication = Publication(
        split,
        floors,
        episodes,
        tuple(tasks) or tuple(TASKS),
        level,
        unfiltered,
        version,
        draft,
        seed,
        None if secret_file is None else read_secret(secret_file),
        layouts,
    )
    manifest = draw_suites(publication, out, execution.options(), fresh)
    for name, entry in manifest.suites.items():
        share = 100.0 * entry.accepted / entry.drawn
        print(
            f"{name}: {entry.episodes} episodes on {entry.floors} of {entry.tried} floors; "
            f"{share:.1f}% of {entry.drawn} drives accepted"
        )
    written(out)
    committed = published_manifest(SEALED_MANIFEST) if split == SEALED else None
    if publish:
        for path in publish_suites(manifest, out):
            written(path)
    elif committed is not None:
        return complaints(committed.differences(manifest))
    return DONE


@refuses_idle_flags("describe splits")
def splits(
    split: SplitNames = ("floors-test",),
    *,
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
