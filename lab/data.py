"""Where the shipped files are: beside the package in a checkout, inside it in an installed wheel."""

from pathlib import Path

from lab.errors import WorkFailed

PACKAGE = Path(__file__).resolve().parent


def tasks_folder() -> Path:
    """The folder of the task files that ship (`*.toml`); raises WorkFailed when the installation lost it."""
    return find("tasks", PACKAGE)


def assets_folder() -> Path:
    """The folder of the shipped URDFs and meshes; raises WorkFailed when the installation lost it."""
    return find("assets", PACKAGE)


def find(name: str, package: Path) -> Path:
    """The data folder `name` of the package folder `package`; raises WorkFailed naming the two places it looked in.

    A folder beside the package counts only next to a `pyproject.toml`: beside an installed package any `tasks` folder
    would be somebody else's.
    """
    wheel, checkout = package / "_data" / name, package.parent / name
    if wheel.is_dir():
        return wheel
    if checkout.is_dir() and (package.parent / "pyproject.toml").is_file():
        return checkout
    raise WorkFailed(
        f"the lab's own '{name}' folder is missing: looked for {wheel} and {checkout}; install the lab again"
    )
