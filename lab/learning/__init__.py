"""How a table is learned: update rules, action selection and the one session."""
