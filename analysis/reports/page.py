"""Data structure of a report, and its rendering as a single self-contained HTML page (template `page.html.j2`).

Figures are inline SVG, and all text is escaped, so that a page can be archived or sent as one file.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from analysis.figures.picture import Picture, render_picture_svg


@dataclass(frozen=True, slots=True)
class Table:
    """A table of a report. All cells are formatted text; the first column names the row."""

    caption: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...] = ()
    """Sentences shown with the table."""
    folded: bool = False
    """Whether only the caption is shown until the reader opens it."""


@dataclass(frozen=True, slots=True)
class Section:
    """A section of a report: a heading, and its text, pictures and tables."""

    heading: str
    paragraphs: tuple[str, ...] = ()
    points: tuple[str, ...] = ()
    """Sentences shown as a list."""
    pictures: tuple[Picture, ...] = ()
    tables: tuple[Table, ...] = ()


@dataclass(frozen=True, slots=True)
class Page:
    """A whole report; `render_page` renders it."""

    title: str
    summary: str
    banner: str
    """Important warnings, shown at the top of the page; empty = none."""
    sections: tuple[Section, ...]
    generated: str
    """Local time at which the report was made, with the UTC offset."""
    provenance: Mapping[str, str] = field(default_factory=dict)
    """Versions, hashes and inputs by name, shown at the end of the page."""


def render_page(page: Page) -> str:
    """The page as HTML without references to other files. All text is escaped. Raises jinja2.UndefinedError where the
    template uses a name that does not exist."""
    environment = Environment(
        loader=PackageLoader("analysis.reports", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template("page.html.j2").render(page=page, svg=_svg)


def _svg(picture: Picture) -> Markup:
    """Inline SVG of a picture, not escaped again."""
    # Safe as markup: drawn by this program, and `render_inline_svg` escapes its title.
    return Markup(render_picture_svg(picture))
