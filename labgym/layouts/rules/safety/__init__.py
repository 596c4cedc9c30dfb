"""Safety rules of touchstone-v2: reagents against the building, equipment, heights, and what stands where.

`rules.RULES` lists them as data; `site.Site` is a layout as they read it.
"""
