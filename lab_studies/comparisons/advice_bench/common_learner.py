"""The learner's settings that AdviceBench's problems have in common."""

from lab.learning.settings import LearnerSettings

COMMON = LearnerSettings(learner="q", alpha=0.95, beta=1.0, episodes=200, max_steps=200)
