"""The tables and figures of the thesis measured again: a file a chapter or appendix."""
