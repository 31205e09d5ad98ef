"""A class: many pupils teach in their browsers, each a learner of their own, and one teacher looks on and helps."""
