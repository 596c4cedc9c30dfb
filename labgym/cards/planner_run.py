"""The files of a planner's training run that its card publishes and describes."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from labgym.documents import Document, write_bytes
from labgym.eval.drawing.pictures import save_picture
from labgym.policies.data import DatasetManifest

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FILES = ("config.json", "weights.safetensors", "history.jsonl")
NOTES = "notes.md"
"""Optional file of a run: a paragraph for the card on how these weights came about."""

Config = TypeVar("Config", bound=Document)


def loss_figure(history: list[dict[str, Any]]) -> Figure:
    """Draw the loss and its terms, each before weighting, against the epoch.

    Args:
        history: rows of `history.jsonl`.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 2.6), facecolor="#ffffff")
    names = list(history[0]["train"])
    for axes, name in zip(figure.subplots(1, len(names)), names, strict=True):
        for kind, color in (("train", "#3d444b"), ("held_out", "#b5482a")):
            rows = [row for row in history if kind in row]
            axes.plot([row["epoch"] for row in rows], [row[kind][name] for row in rows], color=color, label=kind)
        axes.set_title(name, fontsize=9)
        axes.set_ylim(bottom=0.0)
        axes.tick_params(labelsize=7)
        axes.grid(alpha=0.3)
    figure.axes[0].legend(fontsize=7)
    figure.tight_layout()
    return figure


@dataclass(frozen=True, eq=False)
class PlannerRun(Generic[Config]):
    """A training run of a planner.

    Attributes:
        folder: folder of the run.
        config: configuration of the network and its training.
        manifest: manifest of the dataset that it was trained on.
        history: losses, one row per epoch.
    """

    folder: Path
    config: Config
    manifest: DatasetManifest
    history: list[dict[str, Any]]

    @classmethod
    def read(cls, folder: Path, kind: type[Config], manifest: Path) -> PlannerRun[Config]:
        """Read a run and the manifest of its dataset.

        Raises:
            DocumentError: a file is missing or broken.
        """
        lines = (folder / "history.jsonl").read_text(encoding="utf-8").splitlines()
        config = kind.load(folder / "config.json")
        return cls(folder, config, DatasetManifest.load(manifest), [json.loads(line) for line in lines])

    def publish(self, out: Path) -> None:
        """Copy weights, configuration and losses into a folder; add the dataset's manifest and the figure of losses."""
        if self.folder != out:
            for name in (*FILES, *([NOTES] if self.notes else [])):
                write_bytes(out / name, (self.folder / name).read_bytes())
        self.manifest.save(out / "data.json")
        save_picture(loss_figure(self.history), out / "losses.png")

    @property
    def notes(self) -> str:
        """The paragraph of the run's notes, preceded by an empty line; "" without notes."""
        path = self.folder / NOTES
        return f"\n\n{path.read_text(encoding='utf-8').strip()}" if path.is_file() else ""

    @property
    def data_line(self) -> str:
        """The card's line about the dataset."""
        options, shards = self.manifest.options, self.manifest.shards
        layouts = sum(len(shard.layouts) for shard in shards)
        return (
            f"- Data: `labgym data --samples {options.samples} --seed {options.seed}`, "
            f"{sum(shard.samples for shard in shards)} samples from {layouts} generated layouts. `data.json` lists "
            "their hashes; other versions of labgym may generate other layouts."
        )

    @property
    def losses_line(self) -> str:
        """The card's line about the losses after the last epoch."""
        last = self.history[-1]
        kind, where = ("held_out", "held-out") if "held_out" in last else ("train", "training")
        terms = ", ".join(f"{name} {value:.3f}" for name, value in last[kind].items())
        return f"- Mean losses on the {where} layouts after the last epoch: {terms}."
