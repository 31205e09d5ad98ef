"""Comparisons of our own, which the thesis does not print."""
