"""Lessons: a fitting skill is found in the toolbox, or learned and saved; sessions, journals and events of lessons."""
