"""Whole sessions compiled with numba, many at once: what studies run."""
