"""Studies: the tables and figures of the thesis measured again, and comparisons of our own."""
