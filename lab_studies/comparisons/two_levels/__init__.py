"""What two levels buy: the toast task on a small grid, as one flat problem and on two levels."""
