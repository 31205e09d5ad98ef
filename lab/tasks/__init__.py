"""Files become checked frozen models here; the only place where raw text is checked."""
