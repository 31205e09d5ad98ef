"""The rules, advisors and problems that enter a run of AdviceBench: its own, and those of the user."""

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from hashlib import sha256
from typing import Annotated, Any

from annotated_types import Ge

from lab.advice.advisors import ADVISORS as ADDED
from lab.advice.advisors import AdvisorName
from lab.errors import BadInput, check_value, unknown
from lab.files import code_key
from lab.learning.gates import GATES, Gate
from lab.learning.own_rules import WORTH_COMPILING, tell_uncompiled
from lab.plugins.code_file import files_taken, from_file
from lab.teaching.own_members import take_again
from lab_studies.comparisons.advice_bench import families
from lab_studies.comparisons.advice_bench.bad_advisors import ADVISORS, advice_of
from lab_studies.comparisons.advice_bench.problems import HELD_OUT, PROBLEMS, Benched, own_problem, problem
from lab_studies.comparisons.advice_bench.rules import NOBODY, RULES, Rule, rules_of


@dataclass(frozen=True, eq=False)
class Entered:
    """The members of a run by name, in the order of its rows, as another process can make them.

    rules, advisors, problems: the names of all; gates, made, places: what was made in Python, and all problems of the user;
    files: the members from files, see `lab.plugins.code_file.files_taken`; a problem from a file is made anew in each process.
    families_seed: of the instances of the families that are held out.
    """

    rules: tuple[str, ...] = tuple(RULES)
    advisors: tuple[str, ...] = tuple(ADVISORS)
    problems: tuple[str, ...] = (*PROBLEMS, *HELD_OUT)
    gates: Mapping[str, type[Gate]] = field(default_factory=dict)
    made: Mapping[str, AdvisorName] = field(default_factory=dict)
    places: Mapping[str, Benched] = field(default_factory=dict)
    files: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    families_seed: int = families.SEED

    @classmethod
    def of(cls, reading: Mapping[str, Any]) -> "Entered":
        """The members that a reading names: "methods" (rules), "advisors" and "problem", a list or a single one each.

        "families_seed" is that of the families' instances.

        A rule is a name of the bench, a gate's name or a subclass of `lab.Gate`; an advisor a name, a function, an object or a
        class; a problem a name, a file, gym:ID or an object that `lab.teach` takes. Raises BadInput, which names the member.
        """
        gates: dict[str, type[Gate]] = {}
        made: dict[str, AdvisorName] = {}
        places: dict[str, Benched] = {}
        rules = [_rule(given, gates) for given in listed(reading, "methods", RULES)]
        problems = [_problem(given, places) for given in listed(reading, "problem", (*PROBLEMS, *HELD_OUT))]
        advisors = [_advisor(given, made) for given in listed(reading, "advisors", ADVISORS)]
        for rule in rules:
            tell_uncompiled("q", rule, WORTH_COMPILING)
        files = {name: file for name, file in files_taken().items() if name in (*rules, *advisors, *problems)}
        once = [tuple(dict.fromkeys(several)) for several in (rules, advisors, problems)]
        drawn_from = reading.get("families_seed", families.SEED)
        check_value("families_seed", drawn_from, Annotated[int, Ge(0)], "AdviceBench")
        places = {name: place for name, place in places.items() if name not in files}
        entered = cls(once[0], once[1], once[2], gates, made, places, files, drawn_from)
        for name in entered.advisors:
            if name not in ADVISORS:
                for where in entered.problems:
                    advice_of(entered.advisor(name), entered.place(where))
        return entered

    def load(self) -> None:
        """Adds the members from files, and the classes, to the families of this process."""
        take_again(self.files)
        for gate in self.gates.values():
            GATES.named(gate)

    def own_rules(self) -> dict[str, dict[str, Rule]]:
        """The rules by name and budget."""
        return {name: rules_of(name) for name in self.rules}

    def advisor(self, name: str) -> str | AdvisorName:
        """The name of an advisor of the bench, the parsed one of any other."""
        return name if name in ADVISORS else self.made.get(name) or AdvisorName.of(name, "--advisors")

    def place(self, name: str, world: int = 0) -> Benched:
        """The problem of that name; world: the number of a random one, or of an instance of a family."""
        return self.places[name] if name in self.places else problem(name, world, self.families_seed)

    def key(self, name: str, advisor: str | None) -> str:
        """A key of what is the user's own in a case (a problem's name and an advisor's): its code and tables; "" for nothing."""
        modules: list[str] = []
        tables: list[Any] = [self.families_seed] if name in HELD_OUT else []
        if name not in PROBLEMS and name not in HELD_OUT:
            place = self.place(name)
            modules += place.modules
            tables += [place.mdp.signature, sha256(place.values.tobytes()).hexdigest(), vars(place.learner)]
        if advisor is not None:
            modules += [module for rule in self.rules if rule not in RULES for module in GATES.modules_of(rule)]
        if advisor is not None and advisor not in ADVISORS:
            parsed = self.advisor(advisor)
            advice = advice_of(parsed, self.place(name))
            if advice is not None:
                tables += [sha256(array.tobytes()).hexdigest() for array in (advice.thresholds, advice.region)]
            elif advisor in self.made:
                thing = self.made[advisor].itself
                modules.append(str(getattr(thing, "__module__", type(thing).__module__)))
            else:
                modules += ADDED.modules_of(advisor)
        if not (modules or tables):
            return ""
        return sha256(json.dumps([code_key(*sorted(modules)), *tables]).encode()).hexdigest()[:16]


def listed(reading: Mapping[str, Any], name: str, default: Iterable[str]) -> list[Any]:
    """The values of an option. Raises BadInput for an empty list."""
    given = reading.get(name, default)
    several = [given] if isinstance(given, str) or not isinstance(given, Iterable) else list(given)
    if not several:
        raise BadInput(f"{name}: nothing to measure: wanted one or several")
    return several


def _rule(given: Any, gates: dict[str, type[Gate]]) -> str:
    """The name of a rule; a class is added to `gates`."""
    if isinstance(given, str):
        if given not in {*RULES, *GATES}:  # a class of an earlier run is in the family, but not listed
            raise from_file("gate", given, "--methods") or unknown("rule", given, {*RULES, *GATES}, "--methods")
        return given
    if isinstance(given, type) and (
        given.__name__ in {*RULES, *GATES, NOBODY} or gates.get(given.__name__, given) is not given
    ):
        raise BadInput(f"methods: two rules are called '{given.__name__}': give the class another name")
    name = GATES.named(given)
    gates[name] = given
    return name


def _advisor(given: Any, made: dict[str, AdvisorName]) -> str:
    """The name of an advisor; one that was made in Python is added to `made`."""
    if isinstance(given, str):
        if given not in ADVISORS:
            AdvisorName.of(given, "--advisors")
        return given
    parsed = AdvisorName.made(given)
    name = str(parsed)
    if name in {*ADVISORS, *ADDED, NOBODY} or (name in made and made[name].itself is not given):
        raise BadInput(f"advisors: two advisors are called '{name}': give its class or function another name")
    made[name] = parsed
    return name


def _problem(given: Any, places: dict[str, Benched]) -> str:
    """The name of a problem; one of the user is added to `places`."""
    if isinstance(given, str) and (given in PROBLEMS or given in HELD_OUT):
        return given
    place = own_problem(given)
    twice = place.name in places and places[place.name].mdp.signature != place.mdp.signature
    if place.name in PROBLEMS or place.name in HELD_OUT or twice:
        raise BadInput(f"problem: two problems are called '{place.name}': give one a name of its own, see lab.Problem")
    places[place.name] = place
    return place.name
