"""Whether a run did what its task asked for: judged from frames and the task file, by code that did not carry it out."""
