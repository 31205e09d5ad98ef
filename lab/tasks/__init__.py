"""Task, cell and world files as checked, frozen records; raw text is checked only here."""
