"""Figures of a report that are a line each, where a test is about something else: to draw them is most of what it takes
to analyse a session."""

from collections.abc import Callable, Iterator
from types import ModuleType


def list_replacements() -> Iterator[tuple[ModuleType, str, Callable]]:
    """Module, name in it, and what stands there instead. Imports what draws."""
    from matplotlib.figure import Figure

    from analysis.figures import study_pictures
    from study.workflows import picture_files

    yield picture_files, "_render_svg_and_png", _sketch
    for name in vars(study_pictures):
        if name.startswith("draw_") and name != "draw_study_pictures":
            yield study_pictures, name, lambda *_: Figure()


def _sketch(picture) -> tuple[str, bytes]:
    svg = f'<svg xmlns="http://www.w3.org/2000/svg" id="{picture.name}"><path d="M0 0L9 9"/></svg>'
    return svg, b"a sketch" if picture.bitmap else b""
