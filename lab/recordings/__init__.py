"""A robot's recorded episodes: what it saw, what it did, and where somebody else gave the action."""
