"""Where a person answers: at a terminal or on a page, with a live scene of the state in which the learner asks."""
