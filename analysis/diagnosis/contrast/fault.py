"""A fault as a transformation that undoes it: the recording as it would have been without a fault of a given size.

Undoing a fault of size s changes the rows of a base by about s times the change for size 1 (`joint_products`), so that
the size is found by least squares; nonlinear parameters, such as widths and delays, are fixed in each `Variant`.
`mechanism_faults`, `actuator_faults` and `sensor_faults` make the faults, `fit_faults` fits them.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.contrast.recording_part import Part
from equalizer.plant.effect_vocabulary import Place
from equalizer.signals.signal import FloatArray

Undo = Callable[[Part], Part]
"""Maps a part to the part as it would have been without a fault of size 1."""
ColumnChange = Callable[[FloatArray, float, Part], FloatArray]
"""Maps columns (n, k) of a part that predict a command, at a rate in Hz, to those that predict the faulty command."""
ParametersOf = Callable[[FloatArray], dict[str, float]]
"""Maps sizes (sizes,) of a variant to the parameters of the effect, in SI units."""
Curve = Callable[[FloatArray], FloatArray]
"""Maps readings (n,) to readings, sample by sample: a sensor's gain, saturation or nonlinearity."""
ALL_CHANNELS = -1
"""Site number of a fault of all channels; no index of an axis or channel."""


@dataclass(frozen=True, slots=True, eq=False)
class Variant:
    """A fault with its nonlinear parameters fixed. Its sizes multiply the changes made by the functions in `undo`."""

    undo: tuple[Undo, ...]
    """One function per size, each undoing a fault of size 1."""
    parameters_of: ParametersOf
    lower_bound: float = -np.inf
    """Least value of each size."""
    upper_bound: float = np.inf
    """Largest value of each size. Both bounds make a narrow range about 1 where undoing is not linear in the size."""
    error_factor: float = 1.0
    """Factor on the errors with the fault undone: 1 / |g'| of the map g that undoes it (see `compared_base`). Without
    it, a gain that reduces every reading, and so every error, would fit best."""
    curve: Curve | None = None
    """Map of single readings that undoes the fault, where there is one: its slope scales the errors, too."""
    noise_factor: float = 1.0
    """Factor by which interpolation alone reduces the prediction errors: see `interpolation.compute_noise_gain`."""
    column_change: ColumnChange | None = None
    """Change of the predicted command by the fault, where known. Undoing a gain or a lag in the recorded command
    instead would also reduce errors that the fault did not cause."""
    grid_error: float = 0.0
    """Standard error of its parameter where the size is fixed: the distance to the next variant, in the parameter's
    unit."""
    at_size: Callable[[float], "Variant"] | None = None
    """Maps a size to the variant that is linearised about it (that size becomes 1), where undoing is not linear."""
    one_size: bool = False
    """Whether only size 1 undoes the fault: undoing half of a delay gives not half the delay but the mean of two
    readings, which has less noise."""


@dataclass(frozen=True, slots=True, eq=False)
class Fault:
    """A fault of the vocabulary at an axis or channel, with the variants that undo it."""

    effect: str
    """Name of the vocabulary, or a new one in the same style."""
    place: Place
    """Component with the fault: mechanism, actuator or sensor."""
    axis: str
    """Name of the axis or channel; empty for a fault of all channels."""
    site: int
    """Index of the axis or channel, or `ALL_CHANNELS`."""
    variants: tuple[Variant, ...]
    """Each fixes the nonlinear parameters at other values; empty where none suits the recordings."""
    simpler: tuple[str, ...] = ()
    """Faults that it contains as special cases."""
    varies: bool = False
    """Whether it changes during a recording, so that stretches of a faulty recording differ by it, too."""


@dataclass(frozen=True, slots=True)
class ClockRate:
    """A rate at which the delay of the readings grows over the faulty set."""

    rate: float
    """Relative error of the readings' clock rate; 0 = correct."""
    step: float
    """Spacing of the tried rates, relative as well; the standard error of the rate."""
    from_file_start: bool
    """Whether its time is counted from the beginning of the file; else of each part."""


@dataclass(frozen=True, slots=True)
class Lags:
    """Delays and clock rates that cross-correlations suggest, and the time step over which a lag is inverted."""

    lag_samples: int
    """Samples over which a lag of the responses is inverted: 1 for a force balance, one row of an autoregression."""
    delays_s: tuple[float, ...]
    """Delays in s from `likely_delays.suggest_delays_s`."""
    step_s: float
    """Spacing of these delays in s."""
    clocks: tuple[ClockRate, ...]
    """Rates from `likely_delays.suggest_clock_rates`."""


def fix_size(variant: Variant, grid_error: float) -> Variant:
    """Restrict a variant to size 1, as for a delay over many oscillations, which cannot be scaled. grid_error: standard
    error of its parameter, in the parameter's unit."""
    return replace(variant, lower_bound=1.0, upper_bound=1.0, at_size=None, grid_error=grid_error)


def scale_parameter(name: str, value_at_one: float = 1.0) -> ParametersOf:
    """Make the map from a fault's only size to its parameter, proportional to it. value_at_one: the parameter at size
    1."""
    return lambda sizes: {name: value_at_one * float(sizes[0])}
