"""The operator's side of a run: commands in words, the arm moved by hand, an order typed in, and the console's engine."""
