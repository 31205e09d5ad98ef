"""What is to be sequenced, and the answer: stations, routes, an order, chance, objectives, schedules."""
