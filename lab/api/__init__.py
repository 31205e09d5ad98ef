"""What `import lab` gives: the work of the commands as functions, and what they come to as records."""
