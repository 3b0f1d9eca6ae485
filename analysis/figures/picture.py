"""A Matplotlib figure with its name, title, caption and alternative text, and its rendering as inline SVG.

The SVG is reproducible: it contains no date, and its ids are derived from the picture's name.
"""

import io
import re
from dataclasses import dataclass, field, replace

import matplotlib
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.text import Text

from analysis.wording import replace_time_units


def render_inline_svg(figure: Figure, name: str, title: str, description: str = "") -> str:
    """Render a figure as an <svg> element, with a title and a description for screen readers. The layout engine of the
    figure is removed.

    name: letters, digits, hyphens; the prefix of every id, so that two figures on one page have no id in common.
    """
    buffer = io.StringIO()
    # Text is not converted to outlines, so that it can be searched, copied and read by screen readers.
    with matplotlib.rc_context({"svg.fonttype": "none", "svg.hashsalt": name}):
        _lay_out(figure)
        figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    text = buffer.getvalue()
    svg = text[text.index("<svg") :]
    svg = re.sub(r'\bid="', f'id="{name}-', svg)
    svg = svg.replace("url(#", f"url(#{name}-").replace('href="#', f'href="#{name}-')
    opening_tag, svg_body = svg.split(">", 1)
    label_ids = f"{name}-title {name}-description" if description else f"{name}-title"
    desc_element = f'<desc id="{name}-description">{_escape_markup(description)}</desc>' if description else ""
    return (
        f'{opening_tag} role="img" aria-labelledby="{label_ids}">'
        f'<title id="{name}-title">{_escape_markup(title)}</title>'
        f"{desc_element}{svg_body}"
    )


def _lay_out(figure: Figure) -> None:
    """Execute the layout engine once, with the text widths of the SVG renderer, and remove it, because `savefig` draws
    a figure that has a layout engine twice."""
    engine = figure.get_layout_engine()
    if engine is not None and figure.axes:
        dpi = figure.dpi
        FigureCanvasSVG(figure)
        engine.execute(figure)
        figure.dpi = dpi
    figure.set_layout_engine(None)


def _escape_markup(text: str) -> str:
    """Escape the characters &, < and > of XML element content."""
    return text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """A figure with its name, title, caption and alternative text."""

    name: str
    """Letters, digits, hyphens: the name of the picture's file, and the prefix of the ids of its SVG."""
    title: str
    caption: str
    figure: Figure
    folded: bool = False
    """Whether a report shows only the title, and the picture after a click."""
    bitmap: bool = True
    """Whether the picture is also written as PNG."""
    alternative: str = ""
    """Description for screen readers; empty: they read the title alone."""
    rendered_svg: list[str] = field(default_factory=list)
    """Cached result of `render_inline_svg`; empty before the first call of `render_picture_svg`."""


def render_picture_svg(picture: Picture) -> str:
    """Return a picture as inline SVG (`render_inline_svg`); rendered at the first call only."""
    if not picture.rendered_svg:
        picture.rendered_svg.append(render_inline_svg(picture.figure, picture.name, picture.title, picture.alternative))
    return picture.rendered_svg[0]


def remove_figure(picture: Picture) -> Picture:
    """Return a copy of the picture with an empty figure, so that it can be pickled for another process; an SVG that was
    already rendered is kept."""
    return replace(picture, figure=Figure())


def convert_to_sample_units(picture: Picture) -> Picture:
    """Replace seconds and hertz by units of samples in all texts but the title, for a recording with unknown sample
    rate. Texts of the figure are changed in place. To be called before the picture is rendered."""
    for text in picture.figure.findobj(Text):
        if isinstance(text, Text):
            text.set_text(replace_time_units(text.get_text()))
    caption, alternative = replace_time_units(picture.caption), replace_time_units(picture.alternative)
    return replace(picture, caption=caption, alternative=alternative)
