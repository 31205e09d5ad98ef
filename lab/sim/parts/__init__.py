"""Parts: their shapes, and where a gripper takes them."""
