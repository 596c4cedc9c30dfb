"""The view of a building that the rules have: of one rectangular room, or of any other floor."""

from labgym.layouts.rules.building.interface import Building, Entrance, Workplace
from labgym.layouts.rules.building.many_rooms import ManyRooms
from labgym.layouts.rules.building.one_room import OneRoom
from labgym.layouts.rules.building.reading import building_of

__all__ = ["Building", "Entrance", "ManyRooms", "OneRoom", "Workplace", "building_of"]
