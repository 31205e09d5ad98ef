"""Who advises the learner, and when it asks."""
