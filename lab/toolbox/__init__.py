"""The toolbox: learned policies with their versions, and records, in a folder or at an address; no damaged file is loaded."""
