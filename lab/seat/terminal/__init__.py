"""A person at a terminal: questions as text, answers as typed."""
