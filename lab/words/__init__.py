"""Sentences of a person as answers: a grammar over the scene's own words, and what they mean."""
