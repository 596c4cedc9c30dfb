"""How varied and how hard the floors of a split are."""
