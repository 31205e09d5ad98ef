"""A deep student: a DQN in the lab's own sessions, with the gates and the advisors that tables have."""
