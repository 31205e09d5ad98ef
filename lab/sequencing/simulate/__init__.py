"""What a sequence comes to: a readable run, one with alike parts merged, and a compiled one."""
