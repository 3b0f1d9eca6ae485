"""A figure together with what a page or a folder of files needs to show it."""

from dataclasses import dataclass

from matplotlib.figure import Figure


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    name: str
    """Letters, digits, hyphens: the name of its file, and of its place in the page."""
    title: str
    caption: str
    figure: Figure
    folded: bool = False
    """Shown in a report only when asked for."""
