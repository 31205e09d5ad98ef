"""The harness that tries to break the lab for hours, and tools that measure it: `python -m devtools`; not in the wheel."""
