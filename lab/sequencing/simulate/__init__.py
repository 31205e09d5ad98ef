"""The simulations of a cell: a readable run, states with identical parts merged, and a compiled run."""
