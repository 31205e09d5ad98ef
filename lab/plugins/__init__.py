"""Families, and the members that plug-ins add: by entry points of installed packages, or from a file that the user names."""
