"""Find a fitting skill in the toolbox, or learn it: the teacher, its sessions, and what they tell."""
