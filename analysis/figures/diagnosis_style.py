"""Style of a diagnosis' three predictions in all its figures: colour, dash and name."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from matplotlib.axis import Axis
from matplotlib.lines import Line2D

from analysis.figures.style import BLACK, BLUE, ORANGE, PURPLE

Dash = Literal["-"] | tuple[float, tuple[float, ...]]


@dataclass(frozen=True, slots=True)
class Stage:
    name: str
    """As `Findings` calls it."""
    words: str
    colour: str
    dash: Dash
    width: float

    @property
    def handle(self) -> Line2D:
        return Line2D([], [], color=self.colour, linestyle=self.dash, linewidth=self.width, label=self.words)


BEFORE = Stage("before", "as given", ORANGE, (0, (1.2, 1.2)), 1.4)
RETUNED = Stage("retuned", "re-tuned", PURPLE, (0, (4, 1.6)), 1.4)
AFTER = Stage("after", "with what was found", BLUE, "-", 1.4)
_STEPS = ((1.5, (1.0, 1.5, 2.0, 3.0, 5.0, 7.0)), (3.0, (1.0, 2.0, 5.0)), (4.0, (1.0, 3.0)), (np.inf, (1.0,)))
"""Tick multiples by the number of decades of an axis."""

_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")

STAGES = (BEFORE, RETUNED, AFTER)
MEASURED = Line2D([], [], color=BLACK, linewidth=2.6, alpha=0.35, label="measured")


def ratio_ticks(axis: Axis, low: float, high: float) -> None:
    """Round multiples on a logarithmic axis, as many as there is room for. Call after the scale is set."""
    decades = np.log10(high / low)
    steps = next(each for most, each in _STEPS if decades <= most)
    powers = range(int(np.floor(np.log10(low))), int(np.ceil(np.log10(high))) + 1)
    values = [step * 10.0**power for power in powers for step in steps]
    shown = [value for value in values if low <= value <= high]
    axis.set_ticks(shown, labels=[f"{value:.10g}" for value in shown])
    axis.set_ticks([], minor=True)


def power_of_ten(value: float) -> str:
    """0.001 as "10⁻³": written out, because formulas take matplotlib a second."""
    return "10" + f"{np.log10(value):.0f}".translate(_RAISED) if value > 0 else ""
