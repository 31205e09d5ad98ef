"""A whole job carried out, or only planned: the skills it needs, who is where, how long moves take, what a run leaves behind."""


def load_run() -> None:
    """Loads all that carries a run out, as workers do while their parent still does."""
    import scipy.spatial  # noqa: F401

    import lab.production.run  # noqa: F401
    from lab.sim.world import World

    with World():
        pass
