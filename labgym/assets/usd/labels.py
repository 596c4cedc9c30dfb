"""Semantic labels for segmentation, as OpenUSD's UsdSemantics schema stores them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


def write_labels(prim: Any, labels: Mapping[str, str]) -> None:
    """Apply a `UsdSemantics.LabelsAPI` to a prim for each taxonomy and its label."""
    from pxr import UsdSemantics

    for taxonomy, label in labels.items():
        UsdSemantics.LabelsAPI.Apply(prim, taxonomy).CreateLabelsAttr([label])
