"""What the rules read of a building: one rectangular room, or any other floor."""

from labgym.layouts.rules.building.interface import Building, Entrance, Workplace
from labgym.layouts.rules.building.many_rooms import ManyRooms
from labgym.layouts.rules.building.one_room import OneRoom
from labgym.layouts.rules.building.reading import building_of

__all__ = ["Building", "Entrance", "ManyRooms", "OneRoom", "Workplace", "building_of"]
