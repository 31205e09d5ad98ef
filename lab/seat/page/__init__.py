"""A person at a page in the browser: scene, grid, answers and receipt."""
