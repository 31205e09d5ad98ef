"""Whole sessions compiled with numba, many at once, for studies."""
