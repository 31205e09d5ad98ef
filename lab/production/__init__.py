"""A whole job carried out, or only planned: the skills it needs, who is where, how long moves take, what a run leaves behind."""


def load_run() -> None:
    """Loads what surveying and timing need, scipy's hulls and the engine too: a worker's first job, while its parent loads."""
    import scipy.spatial  # noqa: F401

    import lab.production.run  # noqa: F401
    from lab.sim.world import World

    with World():
        pass
