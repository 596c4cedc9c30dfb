"""Types and limits that the records of a floor share, and limits at ways out. Lengths in meters, angles in radians."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

Coordinate = Annotated[float, Field(ge=-100.0, le=100.0)]
IDENTIFIER = r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,79}$"
Identifier = Annotated[str, Field(pattern=IDENTIFIER)]
FarCoordinate = Annotated[float, Field(ge=-2e7, le=2e7)]
"""Coordinates in a file: those of national grids are below."""
Angle = Annotated[float, Field(ge=-7.0, le=7.0)]
Thickness = Annotated[float, Field(ge=0.02, le=1.0)]
Height = Annotated[float, Field(ge=2.2, le=10.0)]
DoorWidth = Annotated[float, Field(ge=0.6, le=4.0)]
DoorHeight = Annotated[float, Field(ge=1.8, le=4.0)]


NFPA_45 = 46.5
"""Square meters: 500 ft2 of a class B laboratory unit (NFPA 45)."""
CALIFORNIA = 18.6
"""Square meters: 200 ft2 (California Building Code, 24 CCR)."""

HOOD_DOOR_LEAST = 1.0
"""Least distance between a hood and a doorway, meters (BS 7258-2 guidance and CEN/TS 14175-5: 1.0 to 1.5 m)."""
