"""Style of the three predictions in all figures of a diagnosis: colour, dash, line width and name.

The stages are the model as given, the re-tuned model, and the completed model with the effects found.
"""

from dataclasses import dataclass
from typing import Literal

from matplotlib.lines import Line2D

from analysis.figures.style import BLACK, BLUE, ORANGE, PURPLE

Dash = Literal["-"] | tuple[float, tuple[float, ...]]
"""Line style of Matplotlib: solid, or an offset with the lengths of dashes and gaps."""


@dataclass(frozen=True, slots=True)
class Stage:
    """Style of a prediction (as given, re-tuned or completed) in all figures of a diagnosis."""

    name: str
    """Key of the stage in the values of `Findings`, such as `channel_errors`."""
    words: str
    """Name of the stage in a legend."""
    colour: str
    dash: Dash
    width: float
    """Line width in points."""

    @property
    def handle(self) -> Line2D:
        """A line without data in this style, for a legend."""
        return Line2D([], [], color=self.colour, linestyle=self.dash, linewidth=self.width, label=self.words)


GIVEN_STAGE = Stage("before", "as given", ORANGE, (0, (1.2, 1.2)), 1.4)
RETUNED_STAGE = Stage("retuned", "re-tuned", PURPLE, (0, (4, 1.6)), 1.4)
COMPLETED_STAGE = Stage("after", "with the effects found", BLUE, "-", 1.4)
STAGES = (GIVEN_STAGE, RETUNED_STAGE, COMPLETED_STAGE)
MEASURED = Line2D([], [], color=BLACK, linewidth=2.6, alpha=0.35, label="measured")
"""Legend entry of the measured signal."""
