"""Pictures to grids: what an overhead camera saw (numpy and OpenCV only)."""
