"""The class's address as a QR code, for the teacher's page and for the terminal."""

from io import StringIO

import segno


def code_svg(address: str) -> str:
    """The code as an SVG image, as a "data:" address."""
    return str(segno.make(address, micro=False).svg_data_uri(scale=4, border=2))


def code_text(address: str) -> str:
    """The code in half blocks, for a terminal."""
    drawn = StringIO()
    segno.make(address, micro=False).terminal(drawn, compact=True, border=2)
    return drawn.getvalue()
