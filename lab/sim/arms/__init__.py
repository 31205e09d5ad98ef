"""Arms: which joints hold the tool where, and an arm in physics with its fingers."""
