"""A report as a value, and its one self-contained page of HTML."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from analysis.figures.picture import Picture, picture_svg


@dataclass(frozen=True, slots=True)
class Table:
    """Everything is text already. The first column names the row."""

    caption: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...] = ()
    folded: bool = False


@dataclass(frozen=True, slots=True)
class Section:
    """A section of a report: a heading, and its text, pictures and tables."""

    heading: str
    paragraphs: tuple[str, ...] = ()
    points: tuple[str, ...] = ()
    """Shown as a list."""
    pictures: tuple[Picture, ...] = ()
    tables: tuple[Table, ...] = ()


@dataclass(frozen=True, slots=True)
class Page:
    """A whole report, as `render_page` takes it."""

    title: str
    summary: str
    banner: str
    """Important warnings; empty = none."""
    sections: tuple[Section, ...]
    generated: str
    """When, by the clock of the place, with its offset."""
    provenance: Mapping[str, str] = field(default_factory=dict)


def render_page(page: Page) -> str:
    """The page as HTML that refers to nothing outside itself. All text is escaped."""
    environment = Environment(
        loader=PackageLoader("analysis.reports", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template("page.html.j2").render(page=page, svg=_svg)


def _svg(picture: Picture) -> Markup:
    # Our own drawing, with its title escaped by inline_svg.
    return Markup(picture_svg(picture))
