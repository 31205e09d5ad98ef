"""Members of the user's own from files, in a further process: what `lab.plugins.code_file.files_taken` lists is taken again."""

from collections.abc import Mapping
from typing import Any

from lab.advice.advisors import ADVISORS
from lab.learning.gates import GATES
from lab.learning.updates import UPDATES
from lab.plugins.code_file import take
from lab.plugins.family import Family
from lab.teaching.named_problems import PROBLEMS

FAMILIES: dict[str, Family[Any]] = {"gates": GATES, "learners": UPDATES, "advisors": ADVISORS, "problems": PROBLEMS}


def take_again(files: Mapping[str, tuple[str, str]]) -> None:
    """Add members from files to the families of this process; files: by name, the kind of family and the word for `take`.

    Members of other families than a lesson's are not needed here, and left out.
    The files' code runs, so they are those that the user has named. Raises BadInput as `take` does.
    """
    for kind, word in files.values():
        if kind in FAMILIES:
            take(FAMILIES[kind], word)
