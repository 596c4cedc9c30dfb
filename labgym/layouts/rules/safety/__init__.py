"""Safety rules: reagents against the building, equipment, heights, and what stands where.

`rules.RULES` lists them as data.
"""
