"""IFC: layouts as building models, and floors from building models."""
