"""Files to checked frozen models: tasks, cells, worlds; the only place where raw text is checked."""
