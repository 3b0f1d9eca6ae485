"""A figure together with what a page or a folder of files needs to show it."""

import io
import re
from dataclasses import dataclass, field, replace

import matplotlib
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.text import Text

from analysis.wording import write_without_time


def inline_svg(figure: Figure, name: str, title: str, description: str = "") -> str:
    """The <svg> element alone, with a title and a description for screen readers. The same figure gives the same text.

    name: letters, digits, hyphens; put before every id, so that two figures in a page do not share any.
    """
    buffer = io.StringIO()
    # Text stays text: it can be read aloud, searched and copied.
    with matplotlib.rc_context({"svg.fonttype": "none", "svg.hashsalt": name}):
        _lay_out(figure)
        figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    text = buffer.getvalue()
    svg = text[text.index("<svg") :]
    svg = re.sub(r'\bid="', f'id="{name}-', svg)
    svg = svg.replace("url(#", f"url(#{name}-").replace('href="#', f'href="#{name}-')
    opening, rest = svg.split(">", 1)
    named = f"{name}-title {name}-description" if description else f"{name}-title"
    described = f'<desc id="{name}-description">{_escape_markup(description)}</desc>' if description else ""
    return (
        f'{opening} role="img" aria-labelledby="{named}"><title id="{name}-title">{_escape_markup(title)}</title>'
        f"{described}{rest}"
    )


def _lay_out(figure: Figure) -> None:
    """Place the axes once, for text as wide as in SVG. `savefig` would draw a figure with any layout engine twice, even
    with an empty one."""
    engine = figure.get_layout_engine()
    if engine is not None and figure.axes:
        resolution = figure.dpi
        FigureCanvasSVG(figure)
        engine.execute(figure)
        figure.dpi = resolution
    figure.set_layout_engine(None)


def _escape_markup(text: str) -> str:
    return text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """A figure with its name, title, caption and alternative text."""

    name: str
    """Letters, digits, hyphens: the name of its file, and of its place in the page."""
    title: str
    caption: str
    figure: Figure
    folded: bool = False
    """Shown in a report only when asked for."""
    bitmap: bool = True
    """Also written as PNG. Diagnoses do without for the many that are folded."""
    alternative: str = ""
    """Description for screen readers; the title alone where empty."""
    drawn: list[str] = field(default_factory=list)
    """Cached result of `inline_svg`, because the page and the file beside it use the same."""


def picture_svg(picture: Picture) -> str:
    """Draw a picture once and return it as inline SVG (see `inline_svg`)."""
    if not picture.drawn:
        picture.drawn.append(inline_svg(picture.figure, picture.name, picture.title, picture.alternative))
    return picture.drawn[0]


def without_figure(picture: Picture) -> Picture:
    """A drawn one that can be sent from another process: its figure is empty."""
    return replace(picture, figure=Figure())


def count_in_samples(picture: Picture) -> Picture:
    """State all texts in samples instead of seconds and hertz, for a recording without known time. Call it before
    drawing."""
    for text in picture.figure.findobj(Text):
        if isinstance(text, Text):
            text.set_text(write_without_time(text.get_text()))
    caption, alternative = write_without_time(picture.caption), write_without_time(picture.alternative)
    return replace(picture, caption=caption, alternative=alternative)
