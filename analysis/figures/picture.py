"""A figure together with what a page or a folder of files needs to show it."""

from dataclasses import dataclass
from functools import lru_cache

from matplotlib.figure import Figure

from analysis.figures.svg import inline_svg


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    name: str
    """Letters, digits, hyphens: the name of its file, and of its place in the page."""
    title: str
    caption: str
    figure: Figure
    folded: bool = False
    """Shown in a report only when asked for."""
    alternative: str = ""
    """What is to be seen, for those who cannot see it; the title alone where empty."""


@lru_cache(maxsize=256)
def picture_svg(picture: Picture) -> str:
    """As `inline_svg`. Drawn once, because the page and the file beside it want the same."""
    return inline_svg(picture.figure, picture.name, picture.title, picture.alternative)
