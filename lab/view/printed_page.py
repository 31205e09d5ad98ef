"""Pages that need neither network nor scripts, and print on A4: the reports of studies and of classes."""

from functools import cache
from pathlib import Path
from typing import Any

from lab.lazy import jinja2

POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"  # of their content
HERE = Path(__file__).parent


def printed_page(template: Path, **known: Any) -> str:
    """The HTML of a page; template: a file that extends `printed_page.html`; known: what it is told, and is escaped in it."""
    return _templates(template.parent).get_template(template.name).render(**known, policy=POLICY)


@cache
def _templates(folder: Path) -> "jinja2.Environment":
    return jinja2.Environment(
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
        loader=jinja2.FileSystemLoader([folder, HERE]),
    )
