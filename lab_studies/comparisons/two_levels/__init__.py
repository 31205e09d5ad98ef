"""The worth of two levels: the toast task on a small grid, as one flat problem and on two levels."""
