"""Line styles and legend labels of the three model predictions, shared by the figures of a diagnosis.

A stage is a state of the model: as given, re-tuned (parameters fitted again), or completed with the effects found.
"""

from dataclasses import dataclass
from typing import Literal

from matplotlib.lines import Line2D

from analysis.figures.style import BLACK, BLUE, ORANGE, PURPLE

Dash = Literal["-"] | tuple[float, tuple[float, ...]]
"""Line style of Matplotlib: solid, or an offset with the lengths of dashes and gaps."""


@dataclass(frozen=True, slots=True)
class StageStyle:
    """Line style and legend label of the prediction of one stage."""

    name: str
    """Key of the stage in the values of `Findings`, such as `channel_errors`."""
    label: str
    """Label in a legend."""
    colour: str
    """Colour of Matplotlib, from `analysis.figures.style`."""
    dash: Dash
    """Line style, with lengths in units of the line width."""
    width: float
    """Line width in points."""

    @property
    def handle(self) -> Line2D:
        """A line without data in this style, for a legend."""
        return Line2D([], [], color=self.colour, linestyle=self.dash, linewidth=self.width, label=self.label)


GIVEN_STAGE = StageStyle("before", "as given", ORANGE, (0, (1.2, 1.2)), 1.4)
RETUNED_STAGE = StageStyle("retuned", "re-tuned", PURPLE, (0, (4, 1.6)), 1.4)
COMPLETED_STAGE = StageStyle("after", "with the effects found", BLUE, "-", 1.4)
STAGES = (GIVEN_STAGE, RETUNED_STAGE, COMPLETED_STAGE)
"""All stages, in the order of their legend entries. Colours differ for colour-blind readers; dashes and widths are
chosen by eye."""
MEASURED_HANDLE = Line2D([], [], color=BLACK, linewidth=2.6, alpha=0.35, label="measured")
"""Legend entry of the measured signal."""
