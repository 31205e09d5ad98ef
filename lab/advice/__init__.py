"""Advisors: who answers, whom to believe, the journal of a session, and the receipt for its advice."""
