"""Rooms of a picture: free areas, divided where they are as narrow as doors."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from labgym.exchange.recognition.picture import Mask, Picture, closed, components, opened

DOOR_WIDTHS = (1.1, 1.6, 2.1, 2.6)
"""Widths of openings at which rooms are divided, meters; the wider ones only where a wall makes them."""
LEAST_AREA = 2.0
"""Area of the smallest room, square meters."""
LARGE = 6.0
"""Area of the smallest room behind a wide opening, square meters."""
DEEPEST_NECK = 0.7
"""Longest way through a wide opening, meters; what is longer is a corridor."""
CLOSET = 0.65
"""Width of the narrowest room of a drawing, meters."""
NOTCH = 1.6
"""Width of the widest piece of furniture at a wall behind which the room goes on, meters."""
PILASTER = 0.45
"""The same for drawings, whose furniture is known: columns and pilasters, meters."""
THICKEST_WALL, LONGEST_STUB = 0.35, 0.9
"""What is thinner and longer than these, and stands at the edge of a room, is a wall and no furniture, meters."""
WALLED = 0.4
"""Least share of the boundary of a room that is wall."""
Labels = NDArray[np.int32]


def rooms_of(picture: Picture, merged: Sequence[Sequence[int]] = ()) -> tuple[Labels, list[tuple[int, int]]]:
    """Return the room of each cell, from 1 on and 0 for none, and the middles of areas that are not enclosed.

    Args:
        merged: numbers of rooms that are one, in the numbering without them.

    Returns:
        (ny, nx) labels, largest room first, and (column, row) of the areas left out.
    """
    labels = _divided(picture)
    labels, dropped = _enclosed(picture, labels)
    labels = _by_size(labels)
    for group in merged:
        labels = _merged(picture, labels, group)
    labels = _filled(picture, labels)
    return labels, dropped


def _divided(picture: Picture) -> Labels:
    """Return parts of the free area that are wider than doors, and those of a drawing that are wider than closets."""
    first, *wider = (picture.cells(width, 2) for width in DOOR_WIDTHS)
    _, labels, stats = components(opened(picture.free, first))
    least = LEAST_AREA / picture.cell**2
    keep = stats[:, cv2.CC_STAT_AREA] >= least
    keep[0] = False
    labels = np.where(keep[labels], labels, 0).astype(np.int32)
    for size in wider:
        labels = _divided_at(picture, labels, size)
    if picture.drawn:
        rest = opened(picture.free & ~ndimage.binary_dilation(labels > 0), picture.cells(CLOSET, 2))
        _, small, stats = components(rest)
        large = stats[:, cv2.CC_STAT_AREA] * picture.cell**2 >= 0.5 * LEAST_AREA
        large[0] = False
        labels = np.where(large[small], small + labels.max(initial=0), labels).astype(np.int32)
    return labels


def _divided_at(picture: Picture, labels: Labels, size: int) -> Labels:
    """Return labels in which rooms are divided at openings of up to some cells that a wall makes."""
    result, following = labels.copy(), int(labels.max(initial=0)) + 1
    slices = ndimage.find_objects(labels)
    for label, window in enumerate(slices, start=1):
        if window is None:
            continue
        own = np.pad(labels[window] == label, 1)
        core = opened(own, size)
        count, parts, stats = components(core)
        large = [p for p in range(1, count + 1) if stats[p, cv2.CC_STAT_AREA] * picture.cell**2 >= LARGE]
        if len(large) < 2:
            continue
        # What the square does not reach is a neck if it lies between two large parts, and a niche otherwise.
        fringe = picture.cells(0.15)
        _, necks, neck_stats = components(opened(own & ~core, fringe))
        near = ndimage.grey_dilation(np.where(np.isin(parts, large), parts, 0), size=(2 * fringe + 1, 2 * fringe + 1))
        if len(neck_stats) < 2:
            continue
        index = np.arange(1, len(neck_stats))
        lowest = ndimage.labeled_comprehension(
            np.where(near > 0, near, count + 1), necks, index, np.min, np.int64, count + 1
        )
        highest = ndimage.labeled_comprehension(near, necks, index, np.max, np.int64, 0)
        depths = np.minimum(neck_stats[1:, cv2.CC_STAT_WIDTH], neck_stats[1:, cv2.CC_STAT_HEIGHT]) * picture.cell
        shallow = np.concatenate([[False], (lowest < highest) & (depths <= DEEPEST_NECK)])
        cut = ndimage.binary_dilation(shallow[necks], iterations=fringe) & ~core
        _, joined, _ = components(own & ~cut)
        joined_count = int(joined.max(initial=0))
        inner = joined[1:-1, 1:-1]
        target = result[window]
        target[labels[window] == label] = 0
        for part in range(1, joined_count + 1):
            cells = inner == part
            if cells.sum() * picture.cell**2 >= LEAST_AREA:
                target[cells] = label if part == 1 else following
                following += part > 1
    return result


def _enclosed(picture: Picture, labels: Labels) -> tuple[Labels, list[tuple[int, int]]]:
    """Return the labels without areas outside the walls, and the middles of those with too few walls around them."""
    count = int(labels.max(initial=0))
    if not count:
        return labels, []
    # The boundary runs over the cells that are not free: solid ones and, where nothing was seen, unknown ones.
    ring = 2 * picture.cells(0.1) + 1
    near_solid = cv2.dilate(picture.solid.astype(np.uint8), np.ones((ring, ring), np.uint8)) > 0
    boundary = (labels > 0) & ndimage.binary_dilation(~picture.free & ~_doorways(picture, labels))
    total = np.bincount(labels[boundary], minlength=count + 1)
    walled = np.bincount(labels[boundary & near_solid], minlength=count + 1)
    out = np.bincount(labels[(labels > 0) & picture.outside], minlength=count + 1)
    area = np.bincount(labels.ravel(), minlength=count + 1)
    bad = (walled < WALLED * total) | (out > 0.5 * np.maximum(area, 1))
    bad |= (area * picture.cell**2 < 0.5 * LEAST_AREA) | (total == 0)
    bad[0] = True
    outer = out > 0
    dropped = []
    for label in np.flatnonzero(bad & (area > 0))[1:].tolist():
        if not outer[label]:
            rows, columns = np.nonzero(labels == label)
            middle = len(rows) // 2
            dropped.append((int(columns[middle]), int(rows[middle])))
    return np.where(bad[labels], 0, labels).astype(np.int32), dropped


def _doorways(picture: Picture, labels: Labels) -> Mask:
    """Return free cells of no room."""
    return np.asarray(picture.free & (labels == 0))


def _by_size(labels: Labels) -> Labels:
    """Return labels renumbered from the largest area to the smallest."""
    areas = np.bincount(labels.ravel())
    areas[0] = 0
    order = [label for label in np.argsort(-areas, kind="stable").tolist() if areas[label]]
    table = np.zeros(len(areas), dtype=np.int32)
    table[order] = np.arange(1, len(order) + 1)
    return table[labels]


def _merged(picture: Picture, labels: Labels, group: Sequence[int]) -> Labels:
    """Return labels in which rooms have the number of the first, with the walls between them."""
    own = np.isin(labels, list(group))
    joined = closed(own, picture.cells(DEEPEST_NECK)) & ((labels == 0) | own)
    return np.where(joined, group[0], labels).astype(np.int32)


def _filled(picture: Picture, labels: Labels) -> Labels:
    """Return labels in which rooms go on behind pieces of furniture at their walls."""
    size = picture.cells(PILASTER if picture.drawn else NOTCH)
    result = labels.copy()
    margin = picture.cells(0.1)
    for label, window in enumerate(ndimage.find_objects(labels), start=1):
        if window is None:
            continue
        ys, xs = window
        area = np.s_[max(ys.start - margin, 0) : ys.stop + margin, max(xs.start - margin, 0) : xs.stop + margin]
        others = ndimage.binary_dilation((result[area] > 0) & (result[area] != label), iterations=margin)
        own = labels[area] == label
        full = closed(own, size) & ~own & ~others & ~picture.outside[area]
        target = result[area]
        target[full & ~_walls(own, full, picture)] = label
    return result


def _walls(own: Mask, full: Mask, picture: Picture) -> Mask:
    """Return the parts of an area to be filled that are walls: those inside a room, and long thin ones at its edge."""
    inside = ndimage.binary_fill_holes(own) & ~own
    thick = opened(full, picture.cells(THICKEST_WALL))
    _, labels, stats = components(full & ~thick)
    longer = np.maximum(stats[:, cv2.CC_STAT_WIDTH], stats[:, cv2.CC_STAT_HEIGHT]) * picture.cell >= LONGEST_STUB
    longer[0] = False
    return np.asarray((full & inside) | longer[labels])
