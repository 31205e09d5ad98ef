"""The auditor: judges from frames and the task file alone whether a run did what its task asked for.

It shares no code with what carried the run out.
"""
