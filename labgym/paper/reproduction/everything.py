"""All studies one after the other, and the page that links to theirs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from labgym.documents import write_text
from labgym.paper.reproduction.figures import PublishedFigures
from labgym.paper.reproduction.page import Link, Page, StudySection
from labgym.paper.reproduction.study import PAGE, Study, code_facts, commit, reproduce
from labgym.runs import ExecutorOptions


def reproduce_all(
    studies: Sequence[Study[Any]],
    out: str | Path,
    executor: ExecutorOptions | None = None,
    fresh: bool = False,
    progress: bool = True,
    remarks: Sequence[str] = (),
) -> tuple[PublishedFigures, ...]:
    """Run studies, each in the subfolder of its name, and write a page that links to theirs.

    Args:
        studies: the studies, with unique names.
        out: the folder.
        executor, fresh, progress: as `reproduce`.
        remarks: sentences for the top of the page, such as what was left out.

    Raises:
        OptionError, LabgymError: as `reproduce`. Finished studies are kept.
    """
    out = Path(out)
    figures = tuple(reproduce(study, out / study.name, executor, fresh, progress) for study in studies)
    write_text(out / PAGE, index_page(figures, remarks).html())
    return figures


def index_page(figures: Sequence[PublishedFigures], remarks: Sequence[str]) -> Page:
    """Return the page that links to the pages of studies, with the first table of each."""
    return Page(
        title="The paper's tables, reproduced",
        subtitle="labgym reproduce all · figures of labgym next to those that the paper prints",
        text=tuple(remarks),
        links=tuple(Link(f"{one.study}/{PAGE}", one.title, one.source) for one in figures),
        sections=tuple(
            StudySection(f"{one.title}" + (f" ({one.source})" if one.source else ""), one.summary, one.tables[:1])
            for one in figures
        ),
        provenance=(*code_facts().items(), ("commit", commit())),
    )
