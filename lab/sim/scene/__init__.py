"""A task's cell in physics: places, bodies, blocked cells, and checks before any work."""
