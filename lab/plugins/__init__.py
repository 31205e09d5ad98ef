"""Members that others add to the families, by entry points of installed packages or from a file that the user names."""
