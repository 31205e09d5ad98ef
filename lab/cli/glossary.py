"""The words of teaching that a newcomer cannot guess: one table for `lab teach --help` and for the README."""

LEARNERS = {
    "q": "Q-learning: what a move is worth is judged by the best move after it",
    "sarsa": "as q, but judged by the move that is really made next",
    "q-lambda, sarsa-lambda": "the same with traces: each step corrects the moves before it, too",
    "monte-carlo": "moves are judged by the whole rest of the episode",
    "afterstate": "learns what the states are worth that moves lead to, not the moves",
}
GATES = {
    "ccrl": "asks for whole episodes while its improvement is below Lambda; rejects an advisor after more than Omega misleads "
    "(the thesis's rule)",
    "ia": "introspection: asks wherever the values of the moves lie within psi of each other, so that it is unsure",
    "combined": "asks only where both ccrl and ia would; rejects as ccrl does",
    "cq": "asks for whole episodes while the last ones took more steps on average than a constant",
    "always, never": "asks about every step, about none",
    "random": "asks about a random share of the steps",
    "importance": "asks wherever the values of the moves lie psi or more apart: there a wrong move costs most",
    "uncertainty": "several tables learn side by side, and it asks where they disagree",
}
TERMS = {
    "gate": "the rule by which a learner decides when to ask",
    "improvement": "how many fewer steps the last episodes took than those before them, in percent",
    "helped step": "a step that was made on advice",
    "guided episode": "an episode with at least one helped step",
    "mislead": "an episode in which it asked and that was no shorter than the mean of those before it: advice did not help",
    "Lambda": "the improvement that is enough: below it ccrl asks",
    "Omega": "how many misleads are tolerated before an advisor is rejected",
    "psi": "the distance between values with which ia, combined and importance compare",
    "trust": "the share of an advisor's answers that led nearer to the goal, as far as the learner can tell",
    "tau": "the skill of a simulated advisor, the smaller the better: .01 an expert, .1 moderate, .3 limited, 1 a novice",
    "sight": "where in a world a simulated advisor sees the robot, and so can advise: everywhere, or in a region",
}


def help_text() -> str:
    """All words, one a line, as typer sets the text below a command's options."""
    groups = {"Learners": LEARNERS, "Gates": GATES, "Words": TERMS}
    return "\n\n".join(
        "\n".join([f"{name}:", *(f"  {word}: {meaning}" for word, meaning in words.items())])
        for name, words in groups.items()
    )


def readme_table() -> str:
    """The gates and the terms as the README shows them."""
    rows = [f"| `{word}` | {meaning} |" for words in (TERMS, GATES) for word, meaning in words.items()]
    return "\n".join(["| word | what it means |", "|---|---|", *rows])
