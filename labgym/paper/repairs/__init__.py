"""The damage benchmark: seeded cases of damage, and the verdict on each repair."""
