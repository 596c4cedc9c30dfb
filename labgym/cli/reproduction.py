"""The commands that reproduce what was published: layouts by their hashes, and the tables of the paper."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from tyro.conf import Positional, arg

from labgym.cli.arguments import THIS_PROCESS, Execution, OptionalPath
from labgym.cli.group import CommandGroup
from labgym.cli.outcome import complaints, findings, written

if TYPE_CHECKING:
    from labgym.eval.reproduction.study import Study

reproduce_app = CommandGroup(default="published")
RUNS = Path("runs/reproduce")
"""Default folder of the studies, each in the subfolder of its name."""


@reproduce_app.command
def published(split: Literal["val", "test"] = "test", out: OptionalPath = None) -> int:
    """Check the published layouts against their hashes, and regenerate them from their seeds.

    They are regenerated only if this version's generator made them; otherwise the release that made them is named.
    Exit 1 if a file or a regenerated layout does not have its hash.

    Args:
        split: The published split.
        out: Also write the layouts that this version makes from the same seeds, with a manifest, to OUT/SPLIT.
    """
    from labgym.layouts import splits

    outcome = splits.reproduce(split, out)
    if out is not None:
        written(out / split)
    print(outcome.notice)
    return complaints(outcome.problems) or findings(())


@reproduce_app.command
def protocols(out: OptionalPath = None, fresh: bool = False, execution: Execution = THIS_PROCESS) -> int:
    """Table 1: counts per protocol, and the entries of the knowledge base (docs/reproduction.md).

    Args:
        out: Folder for index.html, figures.json, figures.csv and rows.jsonl; by default runs/reproduce/protocols.
        fresh: Move the files of the folder aside and start anew.
    """
    from labgym.eval.reproduction.protocols import ProtocolsStudy

    return _reproduced(ProtocolsStudy(), out, execution, fresh)


@reproduce_app.command
def labbuilder(
    folder: Positional[Annotated[Path, arg(metavar="FOLDER")]],
    out: OptionalPath = None,
    fresh: bool = False,
    execution: Execution = THIS_PROCESS,
) -> int:
    """Scenes of LabBuilder's authors: read, scored, repaired, driven in, and written again (docs/labbuilder.md).

    Args:
        folder: Folder of scenes (.json), with asset_bboxes.json and goal_pairs.json for all of them if there are any.
        out: Folder of the results; by default runs/reproduce/labbuilder. Repaired scenes are in layouts, and in
            LabBuilder's form in labbuilder/SCENE.
        fresh: Move the files of the folder aside and start anew.
    """
    from labgym.exchange.labbuilder.study import LabBuilderStudy

    return _reproduced(LabBuilderStudy(folder), out, execution, fresh)


def _reproduced(study: Study[Any], out: Path | None, execution: Execution, fresh: bool) -> int:
    """Run a study, print its tables and the path of its page."""
    from labgym.eval.reproduction.study import PAGE, reproduce

    folder = out if out is not None else RUNS / study.name
    figures = reproduce(study, folder, execution.options(), fresh)
    for table in figures.tables:
        print(f"\n{table.table().text()}")
    print()
    for line in figures.summary:
        print(line)
    return written(folder / PAGE)
