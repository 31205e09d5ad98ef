"""The carried-over policy that ships: what `lab study run carried-over --seed 0` learns on small cells of all families."""

from lab.sequencing.methods.carried_over_policy import CarriedPolicy

DEFAULT = CarriedPolicy(
    {
        "delay": -0.3958,
        "empty-way": -0.0699,
        "idle": -0.0452,
        "part-waited": 0.1204,
        "duration": -0.0708,
        "tail": 0.0617,
        "work-left": 0.3307,
        "load-ahead": -0.0223,
        "starves": 0.0506,
        "queue": 0.2505,
        "load-behind": 0.4261,
        "server": -0.3727,
        "room": 0.0855,
        "moves-left": 0.0424,
        "way-on": -0.3058,
        "other-way": -0.3118,
        "enters": -0.0319,
        "load-after": 0.0176,
        "queued-tail": -0.3235,
    },
    learned_on="240 small cells: all families; lab study run carried-over --sessions 240 --seed 0",
)
