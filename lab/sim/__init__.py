"""PyBullet, and nothing but PyBullet: the cell in physics."""
