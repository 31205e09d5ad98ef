"""What is best in a cell, by a time-based constraint model, and a check of timed plans. It imports nothing of the lab."""
