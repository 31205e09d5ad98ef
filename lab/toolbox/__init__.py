"""What was learned, kept: policies and measured records in a folder, never loaded damaged."""
