"""Rooms of a picture: free areas, divided where they are as narrow as doors."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from labgym.exchange.recognition.picture import Mask, Picture, along, closed, components, near, opened

DOOR_WIDTH = {False: 0.95, True: 1.1}
"""Width of openings of a map and of a drawing at which rooms are divided, meters."""
WIDEST_GAP = 3.6
"""Width of the widest gap between two walls on one line at which rooms are divided, meters."""
WIDEST_END = 2.2
"""Width of the widest gap between the end of a wall and a wall across, meters."""
OFFSET = {False: 0.1, True: 0.05}
"""Distance by which walls of a map and of a drawing on one line may be off it, meters."""
CLEAR = {False: 0.7, True: 0.95}
"""Least share of a gap between two walls that is free."""
STUB = 0.5
"""Length of the shortest wall at a wide gap, meters."""
LEAST_AREA = 2.0
"""Area of the smallest room, square meters."""
LARGE = 6.0
"""Area of the smallest room behind a wide opening, square meters."""
DEEPEST_NECK = 0.7
"""Thickness of the thickest wall between rooms that are merged, meters."""
NARROW = {False: (0.75, 2.5), True: (0.65, 1.0)}
"""Width and area of the smallest narrow room of a map and of a drawing, meters and square meters."""
NOTCH = 1.6
"""Width of the widest piece of furniture at a wall behind which the room goes on, meters."""
PILASTER = 0.45
"""The same for drawings, whose furniture is known: columns and pilasters, meters."""
THICKEST_WALL, LONGEST_STUB = 0.35, 0.9
"""What is thinner and longer than these, and stands at the edge of a room, is a wall and no furniture, meters."""
NARROWEST = {False: 0.1, True: 0.2}
"""Width of the narrowest alcoves and corners of a map and of a drawing, meters."""
LEAST_REST = {False: 0.02, True: 0.5}
"""Area of the smallest alcoves and corners of a map and of a drawing, square meters."""
LEAST_ALCOVE = 0.5
"""Area of the smallest alcove, square meters: smaller ones are corners, or doorways if they lie between rooms."""
MOST_UNKNOWN = 0.25
"""Largest share of the boundary of an alcove that is neither wall nor free."""
THICKEST_OUTER, NARROWEST_WAY = 0.6, 0.5
"""Thickness of the thickest outer wall, and width of the narrowest way through it, meters."""
WALLED = 0.4
"""Least share of the boundary of a room that is wall."""
Labels = NDArray[np.int32]


def rooms_of(picture: Picture, merged: Sequence[Sequence[int]] = ()) -> tuple[Labels, list[tuple[int, int]]]:
    """Return the room of each cell, from 1 on and 0 for none, and the middles of areas that are not enclosed.

    Args:
        merged: numbers of rooms that are one, in the numbering without them; with 0 those that are no rooms.

    Returns:
        (ny, nx) labels, largest room first, and (column, row) of the areas left out.
    """
    labels, dropped = (picture.rooms, []) if picture.rooms is not None else _enclosed(picture, _divided(picture))
    if picture.rooms is None:
        labels = _with_rest(picture, labels)
        dropped = [(column, row) for column, row in dropped if not labels[row, column]]
    labels = _by_size(_stated(picture, labels))
    for group in merged:
        labels = _merged(picture, labels, group)
    labels = _filled(picture, labels)
    return labels if picture.drawn else _without_openings(picture, labels), dropped


def _stated(picture: Picture, labels: Labels) -> Labels:
    """Return labels with the rooms that answers state; rooms that lie mostly in one of them are no more."""
    result = labels.copy()
    for corners in picture.outlines:
        room = picture.inside(corners)
        whole, within = np.bincount(result.ravel()), np.bincount(result[room], minlength=int(result.max(initial=0)) + 1)
        replaced = within > 0.5 * whole
        replaced[0] = False
        result[replaced[result]] = 0
        result[room] = len(whole)
    return result


def _divided(picture: Picture) -> Labels:
    """Return parts of the free area that are wider than doors, and those of a drawing that are wider than closets."""
    free = picture.free & ~_bridges(picture)
    _, labels, stats = components(opened(free, picture.cells(DOOR_WIDTH[picture.drawn], 2)))
    least = LEAST_AREA / picture.cell**2
    keep = stats[:, cv2.CC_STAT_AREA] >= least
    keep[0] = False
    labels = np.where(keep[labels], labels, 0).astype(np.int32)
    width, least = NARROW[picture.drawn]
    rest = opened(free & ~ndimage.binary_dilation(labels > 0), picture.cells(width, 2))
    _, small, stats = components(rest)
    large = stats[:, cv2.CC_STAT_AREA] * picture.cell**2 >= least
    large[0] = False
    return np.where(large[small], small + labels.max(initial=0), labels).astype(np.int32)


def _bridges(picture: Picture) -> Mask:
    """Return the wide gaps between walls on one line that divide a free area into two large ones."""
    free = picture.free
    bridges = np.zeros(free.shape, dtype=np.bool_)
    for axis in (0, 1, 0, 1):  # a gap may end at another one
        free = picture.free & ~bridges
        narrow = ~opened(free, picture.cells(THICKEST_WALL))
        thin = narrow & ~along(narrow, picture.cells(THICKEST_WALL) + 1, 1 - axis, cv2.MORPH_OPEN)
        walls = along(thin, picture.cells(STUB), axis, cv2.MORPH_OPEN)
        walls = along(walls, 2 * picture.cells(OFFSET[picture.drawn]) + 1, 1 - axis, cv2.MORPH_DILATE)
        bridges |= _gaps(picture, walls, free, axis)
    core = opened(picture.free & ~bridges, picture.cells(DOOR_WIDTH[picture.drawn], 2))
    _, parts, stats = components(core)
    large = stats[:, cv2.CC_STAT_AREA] * picture.cell**2 >= LARGE
    large[0] = False
    reach = 2 * picture.cells(0.3) + 1
    grown = cv2.dilate(np.where(large[parts], parts, 0).astype(np.float32), np.ones((reach, reach), np.uint8))
    inverse = np.where(large[parts], len(stats) - parts, 0).astype(np.float32)
    lowest = len(stats) - cv2.dilate(inverse, np.ones((reach, reach), np.uint8))
    _, labels, _ = components(bridges)
    index = np.arange(1, int(labels.max(initial=0)) + 1)
    if not len(index):
        return bridges
    different = ndimage.maximum(grown, labels, index) > ndimage.minimum(lowest, labels, index)
    return np.asarray(np.concatenate([[False], different])[labels])


def _gaps(picture: Picture, walls: Mask, free: Mask, axis: int) -> Mask:
    """Return the gaps between thin walls along an axis, and between the end of one and what it points to.

    Where another wall crosses the end of a wall there is no gap: what lies beyond is a corridor.
    """
    between = along(walls, picture.cells(WIDEST_GAP), axis, cv2.MORPH_CLOSE) & ~walls
    _, labels, stats = components(between)
    whole = np.bincount(labels[free], minlength=len(stats)) >= CLEAR[picture.drawn] * stats[:, cv2.CC_STAT_AREA]
    whole[0] = False
    most = picture.cells(WIDEST_END)
    beyond = along(walls, 2 * most + 1, axis, cv2.MORPH_DILATE) & free & ~walls
    _, ends, stats = components(beyond)
    touching = np.zeros(len(stats), dtype=np.bool_)
    touching[np.unique(ends[along(walls, 3, axis, cv2.MORPH_DILATE)])] = True
    length, width = (stats[:, cv2.CC_STAT_HEIGHT], stats[:, cv2.CC_STAT_WIDTH])[:: 1 if axis == 0 else -1]
    touching &= (length < most) & (width * picture.cell < 2.0 * THICKEST_WALL)
    touching[0] = False
    return np.asarray((whole[labels] & free) | touching[ends])


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


def _with_rest(picture: Picture, labels: Labels) -> Labels:
    """Return labels in which free areas of no room, such as alcoves, belong to the room that they open to."""
    rest = opened(picture.free & (labels == 0) & ~picture.outside, picture.cells(NARROWEST[picture.drawn], 2))
    _, parts, stats = components(rest)
    result = labels.copy()
    areas = stats[:, cv2.CC_STAT_AREA] * picture.cell**2
    for part in np.flatnonzero(areas >= LEAST_REST[picture.drawn])[1:].tolist():
        x, y, width, height = (int(value) for value in stats[part, :4])
        window = np.s_[max(y - 2, 0) : y + height + 2, max(x - 2, 0) : x + width + 2]
        own = parts[window] == part
        around = near(own, 2) & ~own
        rooms = np.bincount(labels[window][around])
        unknown = around & ~picture.free[window] & ~near(picture.solid[window], 1)
        if areas[part] < LEAST_ALCOVE:
            belongs = np.count_nonzero(rooms[1:]) == 1
        else:
            belongs = rooms[1:].any() and unknown.sum() <= MOST_UNKNOWN * around.sum()
        if belongs:
            result[window][own] = 1 + int(np.argmax(rooms[1:]))
    return result


def _without_openings(picture: Picture, labels: Labels) -> Labels:
    """Return labels without the gaps of outer walls: those beyond which there is neither room nor wall."""
    result = labels.copy()
    for axis in (0, 1):
        gaps = along(picture.solid, picture.cells(WIDEST_END), axis, cv2.MORPH_CLOSE) & picture.free & (labels > 0)
        _, parts, stats = components(gaps)
        depth, width = stats[:, cv2.CC_STAT_WIDTH], stats[:, cv2.CC_STAT_HEIGHT]
        depth, width = (depth, width) if axis == 0 else (width, depth)
        through = (depth * picture.cell <= THICKEST_OUTER) & (width * picture.cell >= NARROWEST_WAY)
        nothing = (labels == 0) & ~picture.solid
        for step in (-1, 1):
            beyond = np.roll(parts, step, 1 - axis)
            beyond[gaps] = 0
            total, empty = (np.bincount(beyond[area], minlength=len(stats)) for area in (beyond > 0, nothing))
            outer = empty > 0.5 * np.maximum(total, 1)
            outer[0] = False
            result[(outer & through)[parts]] = 0
    return result


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
    own = (labels > 0) & np.isin(labels, list(group))
    if 0 in group:
        return np.where(own, 0, labels).astype(np.int32)
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
