"""Data classes of a report, and its rendering as a single self-contained HTML page (template `page.html.j2`).

Figures are inline SVG, so that a page can be archived or sent as one file. All text is escaped.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from analysis.figures.picture import Picture, render_picture_svg


@dataclass(frozen=True, slots=True)
class Table:
    """A table of a report. All cells are formatted text; the first column contains the labels of the rows."""

    caption: str
    header: tuple[str, ...]
    """Headings of the columns."""
    rows: tuple[tuple[str, ...], ...]
    """Rows with as many cells as the header has."""
    notes: tuple[str, ...] = ()
    """Sentences shown below the table."""
    folded: bool = False
    """Whether only the caption is shown until a click on it."""


@dataclass(frozen=True, slots=True)
class Section:
    """A section of a report: a heading, and its text, pictures and tables."""

    heading: str
    paragraphs: tuple[str, ...] = ()
    points: tuple[str, ...] = ()
    """Sentences shown as a list."""
    pictures: tuple[Picture, ...] = ()
    tables: tuple[Table, ...] = ()


def drop_empty(*sections: Section) -> list[Section]:
    """Drop the sections that have a heading only."""
    return [each for each in sections if each.paragraphs or each.points or each.pictures or each.tables]


@dataclass(frozen=True, slots=True)
class Page:
    """A complete report."""

    title: str
    summary: str
    banner: str
    """Important warning, shown at the top of the page; empty: no warning."""
    sections: tuple[Section, ...]
    generated: str
    """Local time at which the report was made, with the UTC offset."""
    provenance: Mapping[str, str] = field(default_factory=dict)
    """Versions, hashes and inputs of the analysis by name, shown at the end of the page."""


def render_page(page: Page) -> str:
    """Render the page as HTML without references to other files. Raises jinja2.UndefinedError where the template uses a
    name that does not exist."""
    environment = Environment(
        loader=PackageLoader("analysis.reports", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    # Safe as markup: `render_picture_svg` escapes title and description, and Matplotlib the texts of the figure.
    return environment.get_template("page.html.j2").render(
        page=page, svg=lambda picture: Markup(render_picture_svg(picture))
    )
