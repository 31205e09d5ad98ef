"""What was learned, kept: policies in versions and measured records, in a folder or elsewhere, never loaded damaged."""
