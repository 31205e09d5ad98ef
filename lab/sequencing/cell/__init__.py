"""The cell that is sequenced, and the schedule of its parts: stations, routes, orders, chance, objectives."""
