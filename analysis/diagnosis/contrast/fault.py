"""A fault as something that can be undone: what would have been recorded without it, of a given size."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.contrast.part import Part
from equalizer.plant.effect_vocabulary import Place
from equalizer.signals.signal import FloatArray

Undo = Callable[[Part], Part]


ColumnChange = Callable[[FloatArray, float, Part], FloatArray]
"""Maps columns (n, k) of a part that predict a command, at a rate in Hz, to those that predict the faulty command."""


Numbers = Callable[[FloatArray], dict[str, float]]


Curve = Callable[[FloatArray], FloatArray]
"""Maps readings (n,) to readings."""


EVERY = -1
"""Site number of a fault of all channels."""


@dataclass(frozen=True, slots=True, eq=False)
class Variant:
    """A fault with its nonlinear numbers fixed. Its sizes multiply the changes that the functions in `undo` make."""

    undo: tuple[Undo, ...]
    """One per size, each undoing a fault of size 1."""
    values: Numbers
    """Numbers of the fault from its sizes (steps,)."""
    least: float = -np.inf
    most: float = np.inf
    """Bounds of each size: about 1 where undoing is not linear in the size."""
    unit: float = 1.0
    """Factor by which the errors of a faulty sensor are scaled: else a gain that makes every error small would win."""
    curve: Curve | None = None
    """Where undoing is a map of single readings: by its slope, errors change that were there before."""
    passed: float = 1.0
    """Factor by which undoing makes prediction errors of all samples smaller by interpolation alone: see
    `noise_kept`."""
    column_change: ColumnChange | None = None
    """How the predicted command changes with the fault, where that is known. Undoing a gain or a lag in the recorded
    command instead would make errors smaller that the fault did not cause."""
    grid_error: float = 0.0
    """Standard error of its number where its size is fixed, from the distance to the next variant."""
    about: Callable[[float], "Variant"] | None = None
    """The fault about another size, where undoing it is not linear: that size is its size 1."""
    exact: bool = False
    """Only of size 1 it is the fault: a delay undone by half is no delay, but the mean of two readings, in which noise
    is smaller."""


@dataclass(frozen=True, slots=True, eq=False)
class Fault:
    effect: str
    """A name of the vocabulary, or a new one written like them."""
    place: Place
    axis: str
    site: int
    variants: tuple[Variant, ...]
    simpler: tuple[str, ...] = ()
    """Faults that it holds as special cases."""
    varies: bool = False
    """It changes in the course of a recording, so that stretches of a faulty one differ by it, too."""


@dataclass(frozen=True, slots=True)
class ClockRate:
    """A rate with which the delay of the readings may grow in the course of the faulty set."""

    rate: float
    """Of the clock of the readings, relative: 0 is right."""
    step: float
    """From one of the rates that are tried to the next."""
    runs_on: bool
    """Its time counts from the begin of the file, else of each part."""


@dataclass(frozen=True, slots=True)
class Rows:
    """Spacing of the rows of a base, and the delays and clock rates that cross-correlations suggest."""

    lag_samples: int
    """Samples of the recordings over which a lag of the responses is inverted: one row of an autoregression."""
    late_s: tuple[float, ...]
    """See `likely_delays_s`."""
    late_step_s: float
    """From one of these delays to the next."""
    clocks: tuple[ClockRate, ...]
    """See `likely_clock_rates`."""


def fix_size(variant: Variant, grid_error: float) -> Variant:
    """The variant at size 1 alone. A delay of many oscillations, undone by half, is no delay of half its length."""
    return replace(variant, least=1.0, most=1.0, about=None, grid_error=grid_error)


def proportional_number(name: str, of_one: float = 1.0) -> Numbers:
    """A fault's number in proportion to its only size. of_one: the number at size 1."""
    return lambda sizes: {name: of_one * float(sizes[0])}
