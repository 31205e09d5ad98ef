"""A whole job, carried out or only planned: its skills, durations, order, execution in physics, and files."""


def load_run() -> None:
    """Loads the modules for surveying and timing, scipy's hulls and the engine: a worker's first job, while its parent loads."""
    import scipy.spatial  # noqa: F401

    import lab.production.run  # noqa: F401
    from lab.sim.world import World

    with World():
        pass
