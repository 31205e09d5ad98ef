"""How a table of action values is learned with advice: update rules, action selection, gates and the session."""
