"""How a sequence is found: one file a method, and what several of them share."""
