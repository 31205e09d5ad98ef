"""What tries to break the lab for hours, and what measures it: `python -m devtools`; not part of the wheel."""
