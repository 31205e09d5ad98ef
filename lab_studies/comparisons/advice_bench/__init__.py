"""AdviceBench: when to ask, and whom to believe, measured over problems, advisors and budgets."""
