"""When a robot's policy should ask: measures of doubt, their calibration, and whether the last help was any."""
