"""A task's cell: where things stand, what is built there, and what blocks the tool."""
