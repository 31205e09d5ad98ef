"""The cells that tests of sequencing are made with."""

from sequencing_cells import cells, crossing_cell, ends, fms_cell, oven_cell, shops, toast_cell

__all__ = ["cells", "crossing_cell", "ends", "fms_cell", "oven_cell", "shops", "toast_cell"]
