"""A whole job carried out, or only planned: skills, durations, the order of transfers, physics."""
