"""Our own comparisons, which are not in the thesis."""
