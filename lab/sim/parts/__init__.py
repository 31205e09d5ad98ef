"""Parts: their shapes, their grips, and how firmly they are held."""
