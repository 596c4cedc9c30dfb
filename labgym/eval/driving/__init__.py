"""Navigation: which episodes, how they are driven, and the figures over them."""
