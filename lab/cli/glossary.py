"""The words that a newcomer cannot guess, for help and README: the members of families by their tables, the rest here."""

TERMS = {
    "gate": "the rule by which a learner decides when to ask",
    "improvement": "how many fewer steps the last episodes took than those before them, in percent",
    "helped step": "a step that was taken on advice",
    "guided episode": "an episode with at least one helped step",
    "mislead": "an episode with questions that was no shorter than the mean of those before it: advice did not help",
    "Lambda": "the improvement that is enough: below it ccrl asks",
    "Omega": "how many misleads are tolerated before an advisor is rejected; a budget of helped steps may end advice earlier",
    "psi": "the distance between action values at which ia, combined and importance decide",
    "trust": "the share of an advisor's answers that led nearer to the goal, by the learner's estimate",
    "tau": "the skill of a simulated advisor, the smaller the better: .01 an expert, .1 moderate, .3 limited, 1 a novice",
    "sight": "where in a world a simulated advisor sees the robot and can advise: everywhere, or in a region",
}
TEXTS = {  # what stands below a command's options -> its headings, each with a family of `lab.cli.families`
    "words of teaching": {"Learners": "learners", "Gates": "gates", "Words": "terms"},
    "words of sequencing": {"Methods": "methods", "Instance files": "instances"},
    "words of instances": {"Instance files": "instances"},
    "words of exporting": {"Formats": "export formats"},
}
