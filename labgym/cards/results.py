"""The evaluation sections of all model cards: metrics, drives, failures, and the table of an ablation study."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from labgym.errors import OptionError
from labgym.eval.drawing.pictures import save_picture
from labgym.eval.driving.episode_row import TransitionRow
from labgym.eval.driving.evaluation import TransitionEvaluation
from labgym.eval.driving.files import EPISODES, SUMMARY, read_rows
from labgym.eval.driving.paired import MetricDifference, differences, paired
from labgym.eval.driving.record import NavigationSummary
from labgym.eval.reports.route_figures import drives_figure, sampled, what_went_wrong
from labgym.eval.reports.tables import navigation_table
from labgym.layouts import Layout
from labgym.table import Table, number

DRIVES, FAILURES = "drives.png", "failures.png"
SHOWN_FAILURES = 10

ABLATION_COLUMNS = (("success", "SR ↑"), ("spl", "SPL ↑"), ("collision_free", "Collision-free SR ↑"))


@dataclass(frozen=True)
class CardResults:
    """A complete evaluation of a policy, as its card shows it.

    Attributes:
        evaluation: its summary, rows and routes.
        layouts: layouts of the suite, by id.
    """

    evaluation: TransitionEvaluation
    layouts: dict[str, Layout]

    @classmethod
    def read(cls, folder: Path, policy: str) -> CardResults:
        """Read the folder of an evaluation.

        Raises:
            DocumentError: a file is missing or broken.
            OptionError: the evaluation is not complete, of another policy, or its files do not agree.
        """
        evaluation = TransitionEvaluation.read(folder)
        if evaluation.problems:
            raise OptionError(evaluation.problems[0])
        summary = evaluation.summary
        if summary.policy != policy or not summary.complete:
            state = "complete" if summary.complete else "incomplete"
            raise OptionError(
                f"{folder} holds a {state} evaluation of {summary.policy!r}; expected a complete one of {policy!r}"
            )
        return cls(evaluation, {layout.id: layout for layout in summary.suite.load_layouts()})

    @property
    def failures(self) -> list[TransitionRow]:
        """The failed episodes, in the suite's order."""
        return [row for row in self.evaluation.rows if not row.success]

    def draw(self, out: Path) -> None:
        """Draw ten drives, and the first ten failed ones, into a folder; remove the latter's picture if none failed."""
        rows, failures = self.evaluation.rows, self.failures
        save_picture(drives_figure(self.evaluation, self.layouts, sampled(rows)), out / DRIVES)
        if failures:
            save_picture(drives_figure(self.evaluation, self.layouts, failures[:SHOWN_FAILURES]), out / FAILURES)
        else:
            (out / FAILURES).unlink(missing_ok=True)

    def markdown(self, title: str = "Results", level: int = 2) -> str:
        """Return the card's sections on results and failures; they show the pictures of `draw`.

        Args:
            title: of the first section. level: of its heading.
        """
        marks = "#" * level
        summary = self.evaluation.summary
        return f"""{marks} {title}

{navigation_table({summary.policy: self.evaluation.metrics}, f"suite {summary.suite.label}").markdown()}

Command: `labgym eval --policy {summary.policy} --suite {summary.suite.name}`, seed {summary.seed}, \
{summary.episodes} episodes{self._commits}.

![Ten drives over their maps]({DRIVES})

{marks} Failures

{self._failures_section()}"""

    @property
    def _commits(self) -> str:
        """The commits of the checkouts that drove, as the end of a sentence; "" outside a checkout."""
        commits = dict.fromkeys(
            f"`{each.commit[:7]}`{' with changes' if each.dirty else ''}"
            for each in self.evaluation.provenance
            if each.commit is not None
        )
        return f", driven by commit {', '.join(commits)}" if commits else ""

    def _failures_section(self) -> str:
        failures = self.failures
        if not failures:
            return "In these single rooms, every episode succeeded."
        drawn = min(len(failures), SHOWN_FAILURES)
        shown = "." if drawn == len(failures) else f"; the first {drawn} are drawn."
        lines = [f"{len(failures)} of {len(self.evaluation.rows)} episodes failed{shown}", ""]
        lines += ["| layout | room | pair | outcome |", "| --- | --- | --- | --- |"]
        lines += [
            f"| {row.layout} | {self.layouts[row.layout].room.name} | {_numbered(row)} "
            f"| {what_went_wrong(row, self.evaluation.routes[row.key])} |"
            for row in failures
        ]
        return "\n".join([*lines, "", f"![Failed drives]({FAILURES})"])


def _numbered(row: TransitionRow) -> str:
    """Return the number of a row's pair, with that of the repeat after the first."""
    return f"{row.pair}, repeat {row.repeat}" if row.repeat else str(row.pair)


def ablation_table(folder: Path, titles: Mapping[str, str]) -> str:
    """Return a Markdown table of evaluations, one per row, and a sentence on the effects that they show.

    A row has the means of a variant and, in brackets, the 95% intervals of its paired differences from the first one.

    Args:
        folder: with one evaluation's folder per variant.
        titles: titles of the rows by the folder's name, in order; the first is the unchanged policy. Variants without a
            folder are named below the table.

    Raises:
        OptionError: an evaluation is not complete, or they are of different suites.
        DocumentError: one cannot be read, or the first is missing.
    """
    first, *others = titles
    driven = [first, *(name for name in others if (folder / name).is_dir())]
    summaries = {name: NavigationSummary.load(folder / name / SUMMARY) for name in driven}
    suites = {summary.suite.label for summary in summaries.values()}
    if len(suites) != 1 or not all(summary.complete for summary in summaries.values()):
        raise OptionError(
            f"{folder} holds evaluations of the suites {sorted(suites)}, or incomplete ones; expected complete ones "
            "of one suite"
        )
    rows = {name: read_rows(folder / name / EPISODES) for name in driven}
    changes = {name: differences(paired(rows[name], rows[first]), "touchstone") for name in driven[1:]}
    table = Table(
        title="",
        columns=("Variant", *(heading for _, heading in ABLATION_COLUMNS)),
        rows=tuple(
            (
                titles[name],
                *(
                    number(summary.metrics[key].value, 3) + (_change(changes[name][key]) if name in changes else "")
                    for key, _ in ABLATION_COLUMNS
                ),
            )
            for name, summary in summaries.items()
        ),
        notes=(
            f"Suite {suites.pop()}, {len(rows[first])} episodes each; in brackets: difference from "
            f'"{titles[first]}" in the same episodes, with its 95% interval over layouts.',
        ),
    ).markdown()
    missing = [titles[name] for name in titles if name not in driven]
    unknown = f" Not driven: {'; '.join(missing)}." if missing else ""
    return f"{table}\n\n{_effects(changes, titles)}{unknown}"


def _change(change: MetricDifference) -> str:
    """Return a paired difference with its interval, in parentheses."""
    value, low, high = change.difference.value, change.difference.low, change.difference.high
    if value is None or low is None or high is None:
        return ""
    return f" ({value:+.3f} [{low:+.3f}, {high:+.3f}])"


def _effects(changes: Mapping[str, Mapping[str, MetricDifference]], titles: Mapping[str, str]) -> str:
    """Return a sentence on the variants none of whose differences has an interval without zero."""
    first = next(iter(titles.values()))
    same = [titles[name] for name in changes if not any(changes[name][key].significant for key, _ in ABLATION_COLUMNS)]
    if not same:
        return f'Every variant in the table differs from "{first}" by an interval without zero in at least one column.'
    if len(same) == len(changes):
        return f'No variant differs from "{first}" by an interval without zero: the study shows no effect.'
    return f'Not distinguishable from "{first}" (all intervals contain zero): {"; ".join(same)}.'
