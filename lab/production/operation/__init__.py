"""The operator's side of a run: commands in words, motions of the arm by hand, typed orders, and the console's engine."""
