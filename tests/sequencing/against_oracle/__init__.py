"""The lab's sequencing against the oracle: its cells and plans as the oracle's data, drawn cells, and what is compared."""
