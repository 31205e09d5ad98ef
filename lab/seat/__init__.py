"""Where a person answers: a terminal, a page, and the stage that shows where the learner asks."""
