"""The page of a study: self-contained HTML with tables and pictures, without scripts or external resources."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from labgym.eval.reports.report import Picture, page_environment
from labgym.paper.reproduction.figures import FigureTable, PublishedFigures


@dataclass(frozen=True)
class Plate:
    """A picture with its caption and remarks.

    Attributes:
        title: what it shows.
        picture: the picture, with the text that replaces it.
        lines: remarks below it, in order; numbers of marks first.
        good: whether it shows a success; None for neither.
    """

    title: str
    picture: Picture
    lines: tuple[str, ...] = ()
    good: bool | None = None


@dataclass(frozen=True)
class StudySection:
    """A part of the page: heading, paragraphs, tables and pictures.

    Attributes:
        wide: whether the pictures have the whole width of the page.
    """

    heading: str
    text: tuple[str, ...] = ()
    tables: tuple[FigureTable, ...] = ()
    plates: tuple[Plate, ...] = ()
    wide: bool = False


@dataclass(frozen=True)
class Link:
    """A link to another page, relative to this one."""

    href: str
    text: str
    note: str = ""


@dataclass(frozen=True)
class Page:
    """A page.

    Attributes:
        title, subtitle: its head.
        text: paragraphs below the head.
        sections: its content. links: other pages.
        provenance: names and values.
    """

    title: str
    subtitle: str
    text: tuple[str, ...] = ()
    sections: tuple[StudySection, ...] = ()
    links: tuple[Link, ...] = ()
    provenance: tuple[tuple[str, str], ...] = field(default=())

    def html(self) -> str:
        """Return the page; all text is escaped."""
        return page_environment("labgym.paper.reproduction").get_template("study.html.j2").render(page=self)


def study_page(figures: PublishedFigures, sections: Sequence[StudySection], commit: str) -> Page:
    """Return the page of a study: its tables, then further sections, then how it was made.

    Args:
        figures: the figures.
        sections: pictures and explanations.
        commit: the commit of the checkout, in words.
    """
    return Page(
        title=figures.title,
        subtitle=f"labgym reproduce {figures.study}" + (f" · {figures.source} of the paper" if figures.source else ""),
        text=figures.summary,
        sections=(StudySection("Figures", tables=figures.tables), *sections),
        provenance=(*figures.facts.items(), ("commit", commit)),
    )
