"""A whole job carried out, or only planned: the skills it needs, who is where, how long moves take, what a run leaves behind."""
