"""Figures that several model cards show."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure


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
