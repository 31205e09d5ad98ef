"""From pictures to grids and parts: camera calibration, markers in a picture, the grid they define, and picture files."""

from lab.vision.grid_view import GridView, Marker, View, plain_view
from lab.vision.lens import Lens
from lab.vision.markers import MARKERS, draw, find_markers, locate, see
from lab.vision.picture_files import Image, read_picture, write_picture

__all__ = [
    "MARKERS",
    "GridView",
    "Image",
    "Lens",
    "Marker",
    "View",
    "draw",
    "find_markers",
    "locate",
    "plain_view",
    "read_picture",
    "see",
    "write_picture",
]
