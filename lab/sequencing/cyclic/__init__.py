"""Cyclic orders: moves that the robot repeats for ever, and the shortest period in which it can."""
