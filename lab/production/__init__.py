"""A whole job carried out: which skills it needs, who is where, how long moves take, and what a run leaves behind."""
