"""The floor area up to which one way out of a laboratory is enough."""

NFPA_45 = 46.5
"""Square meters: 500 ft2 of a class B laboratory unit (NFPA 45)."""
CALIFORNIA = 18.6
"""Square meters: 200 ft2 (California Building Code, 24 CCR)."""
