"""Areas and distances at ways out and doorways that families of floors and rules share."""

NFPA_45 = 46.5
"""Square meters: 500 ft2 of a class B laboratory unit (NFPA 45)."""
CALIFORNIA = 18.6
"""Square meters: 200 ft2 (California Building Code, 24 CCR)."""

HOOD_DOOR_LEAST = 1.0
"""Least distance between a hood and a doorway, meters (BS 7258-2 guidance and CEN/TS 14175-5: 1.0 to 1.5 m)."""
