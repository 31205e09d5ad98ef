"""Arms: their kinematics, the paths of their tools, and an arm with its fingers in physics."""
