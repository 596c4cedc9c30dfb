"""The files of a planner's training run that its card publishes and describes."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

from labgym.cards.figures import loss_figure
from labgym.documents import Document, write_bytes
from labgym.eval.drawing.pictures import save_picture
from labgym.policies.data import DatasetManifest

FILES = ("config.json", "weights.safetensors", "history.jsonl")
NOTES = "notes.md"
"""Optional file of a run: a paragraph for the card on how these weights came about."""

Config = TypeVar("Config", bound=Document)


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
