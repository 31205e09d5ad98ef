"""Behaviour cloning with a mentor: a student learns from demonstrations, and from corrections that it asks for."""
