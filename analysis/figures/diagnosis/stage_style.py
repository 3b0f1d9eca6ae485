"""Style of a diagnosis' three predictions in all its figures: colour, dash and name."""

from dataclasses import dataclass
from typing import Literal

from matplotlib.lines import Line2D

from analysis.figures.style import BLACK, BLUE, ORANGE, PURPLE

Dash = Literal["-"] | tuple[float, tuple[float, ...]]


@dataclass(frozen=True, slots=True)
class Stage:
    """Style of a prediction (as given, re-tuned or completed) in all figures of a diagnosis."""

    name: str
    """Name of the field in `Findings`."""
    words: str
    colour: str
    dash: Dash
    width: float

    @property
    def handle(self) -> Line2D:
        """A line without data in this style, for a legend."""
        return Line2D([], [], color=self.colour, linestyle=self.dash, linewidth=self.width, label=self.words)


BEFORE = Stage("before", "as given", ORANGE, (0, (1.2, 1.2)), 1.4)
RETUNED = Stage("retuned", "re-tuned", PURPLE, (0, (4, 1.6)), 1.4)
AFTER = Stage("after", "with what was found", BLUE, "-", 1.4)
STAGES = (BEFORE, RETUNED, AFTER)
MEASURED = Line2D([], [], color=BLACK, linewidth=2.6, alpha=0.35, label="measured")
