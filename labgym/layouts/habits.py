"""Planning habits of synthesis laboratories, as data: which wall, near what, which cabinet for which storage class.

`assets/layouts/habits.json` holds them; `Habits.published()` reads and validates the file once per process.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from labgym.artefacts import artefacts
from labgym.assets.model import StorageClass
from labgym.documents import Document, Record
from labgym.layouts.brief import Furnishing, Stance
from labgym.layouts.ground import Use

Side = Literal["front", "back", "store", "work"]
"""A wall by its role: `store` and `work` are the two side walls; the seed decides which of them is the left one."""
Share = Annotated[float, Field(ge=0.0, le=1.0)]
Span = tuple[Share, Share]


class Habit(Record):
    """Where a kind of furniture usually stands.

    Attributes:
        walls: preferred walls, best first.
        stance: against a wall, or free-standing.
        side: preferred span of a side wall, 0 at the front to 1 at the back.
        front: preferred span of the front wall, 0 at the end with the door to 1 at the other.
        back: preferred span of the back wall, 0 at the store side to 1 at the work side.
        clear: free depth in front, meters; None for the catalog's clearance.
    """

    walls: tuple[Side, ...] = ("store", "work", "front", "back")
    stance: Stance = "wall"
    side: Span | None = None
    front: Span | None = None
    back: Span | None = None
    clear: Annotated[float, Field(ge=0.0, le=5.0)] | None = None


class HabitualPiece(Record):
    """A piece that a room gets from a level of furnishing on, and its purpose."""

    asset: str
    level: Furnishing
    reason: str


class StorageCabinet(Record):
    """The cabinet for a storage class and the number of containers that it takes."""

    asset: str
    capacity: Annotated[int, Field(ge=1, le=1000)]


class Neighbors(Record):
    """Two kinds of furniture that stand close to each other, with an integer weight."""

    first: str
    second: str
    weight: Annotated[int, Field(ge=1, le=100)] = 1


class Accessory(Record):
    """A small object and what it hangs or stands near: an asset, "door", or "hood" for the first fume hood."""

    asset: str
    near: str


class Dressing(Record):
    """Objects that no protocol requires and that make a room look used.

    Attributes:
        floor: bins.
        rooms: hung on the walls of each space of a floor, by its use.
        surfaces: placed on a kind of furniture; none of them emits heat. islands: drawn for every island.
        shelves: drawn for every shelf of a kind of furniture.
        island_shelf: shelf along the middle of an empty island. seat: stool. seated: desks that get a seat.
    """

    rooms: dict[Use, tuple[Accessory, ...]]
    floor: tuple[Accessory, ...]
    surfaces: dict[str, tuple[str, ...]]
    islands: tuple[str, ...]
    shelves: dict[str, tuple[str, ...]]
    island_shelf: str
    seat: str
    seated: tuple[str, ...]


class RoomHabit(Record):
    """Furniture of a space of some use, beyond what protocol and safety require.

    Attributes:
        walls: rows along the walls.
        islands: free-standing benches, without which nothing stands in the open.
        backs: wall benches that may stand back to back in the open.
    """

    walls: tuple[str, ...] = ()
    islands: tuple[str, ...] = ()
    backs: tuple[str, ...] = ()


class Habits(Document):
    """All planning habits.

    Attributes:
        habits: by asset name; assets that are absent stand at any wall.
        always: locations of every laboratory, with their purpose.
        furniture: further pieces by level. filling: benches, racks and cold storage for walls that stay free.
        peninsula: the bench with one end at a wall.
        homes: where an instrument of a category stands when the protocol does not say. default_home: else.
        cabinets: by storage class, in the order in which the cabinets are planned.
        uses: uses of the spaces in which a kind of furniture stands, best first; laboratories if it is absent.
        together: furniture that stands in the space of the first hood.
        rooms: by the use of a space.
    """

    SCHEMA: ClassVar[str] = "labgym.habits/1"

    habits: dict[str, Habit]
    always: dict[str, str]
    furniture: tuple[HabitualPiece, ...]
    filling: tuple[str, ...]
    peninsula: str
    homes: dict[str, str]
    default_home: str
    cabinets: dict[StorageClass, StorageCabinet]
    near: tuple[Neighbors, ...]
    uses: dict[str, tuple[Use, ...]]
    together: tuple[str, ...]
    rooms: dict[Use, RoomHabit]
    dressing: Dressing

    @classmethod
    def published(cls) -> Habits:
        """Return the published habits.

        Raises:
            DocumentError: the file is missing or invalid.
        """
        return _published()

    def uses_of(self, role: str) -> tuple[Use, ...]:
        """Return the uses of the spaces in which furniture of a role stands, best first."""
        return self.uses.get(role, ("laboratory",))

    def rank_of(self, role: str, use: Use) -> int:
        """Return how well a space of some use suits furniture of a role, 0 for the best."""
        uses = self.uses_of(role)
        return uses.index(use) if use in uses else len(uses)

    def of(self, asset: str) -> Habit:
        """Return the habit of an asset; any wall if the file lists none."""
        return self.habits.get(asset, Habit())


@lru_cache
def _published() -> Habits:
    return Habits.load(artefacts("assets") / "layouts" / "habits.json")
