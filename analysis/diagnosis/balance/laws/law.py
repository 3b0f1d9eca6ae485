"""A term of a force balance: its columns along a measured motion, and the parameters that follow from its weights. The
other files of this folder make the laws; `regression` fits them.

The balance of one axis is linear in its weights w,

    f(t) = m a(t) + d v(t) + k q(t) + c + sum over laws l of phi_l(q, v, a, ...; n_l)' w_l + e(t),

with the force f, the measured motion q, v, a, and for each law columns phi (regressors) that may depend on a few
nonlinear parameters n, such as the width of a gap. A law here resists the motion, as mass and damping do.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft, rfftfreq

from analysis.diagnosis.balance.motion import Motion
from equalizer.signals.signal import FloatArray

NonlinearParameters = tuple[float, ...]
"""Nonlinear parameters of a law, such as a speed, a pitch and a time constant, in SI units; empty for none."""
Columns = Callable[[Motion, NonlinearParameters], FloatArray]
"""Maps a motion of n samples and nonlinear parameters to the law's regressors (n, weights)."""
WeightConverter = Callable[[FloatArray, NonlinearParameters, float], dict[str, float] | None]
"""Maps weights (weights,), nonlinear parameters and the moving mass in kg (kg m²) to the effect's parameters in SI
units; None where the values are not physical, such as a negative friction."""


@dataclass(frozen=True, slots=True)
class Formula:
    """A law in the language of `equalizer.laws`; q, v and f are position, velocity and command of its axis."""

    text: str
    """Formula with the free parameters p0, p1, …"""
    numbers: tuple[float, ...]
    """Values of p0, p1, … in SI units."""
    acts_on: Literal["force", "command"] = "command"
    """force: the formula's value is added to the force at the axis; command: it replaces the command."""


@dataclass(frozen=True, slots=True, eq=False)
class Law:
    """A law as a term of a force balance: columns for given nonlinear parameters, and the parameters of the effect from
    the fitted weights."""

    effect: str
    """Name of the effect in the catalogue (`equalizer.effects`), or a new name for physics that the catalogue lacks."""
    channel: int
    """Index of the motion's channel that it depends on; -1 = none."""
    numbers: NonlinearParameters
    """Values of its nonlinear parameters."""
    make_columns: Columns
    """Makes the regressors (n, weights) of a motion."""
    convert_weights: WeightConverter
    """Converts fitted weights to the parameters of the effect."""
    is_linear: bool = False
    """Whether it is linear in the motion, so that a linear model of a higher order could replace it."""
    bounds: tuple[tuple[float, float], ...] = ()
    """Bounds of each nonlinear parameter within which it is refined; empty: it keeps its given value."""
    formula: Callable[[dict[str, float]], Formula] | None = None
    """Maps its parameters to the formula that simulations use; None where the catalogue has the effect, or the law is
    not simulated."""

    @property
    def key(self) -> tuple[str, int]:
        """Effect and channel: laws with the same key differ in their parameters only."""
        return self.effect, self.channel

    def make_formula(self, values: dict[str, float] | None) -> Formula | None:
        """Make the formula with these parameters; None for a law without one, or without parameters."""
        return self.formula(values) if self.formula is not None and values else None


@dataclass(frozen=True, slots=True, eq=False)
class BaseTerms:
    """Linear terms in the balance of one axis, in addition to mass, damping and stiffness."""

    driven_channel: int
    """Channel of the motion that the force drives."""
    laws: tuple[Law, ...] = ()
    """Laws that are linear in the motion."""
    delay_s: float = 0.0
    """Delay from the force to the motion; the motions' forces are already shifted by it."""


@dataclass(frozen=True, slots=True)
class Scales:
    """Sizes of one channel's motion on the fit samples."""

    speed: float
    """rms speed in m/s (rad/s)."""
    travel: float
    """Peak-to-peak travel, from `low` to `high`, in m (rad)."""
    low: float
    """Lowest position in m (rad)."""
    high: float
    """Highest position in m (rad)."""
    duration_s: float
    """Duration of all fit samples in s."""
    band_hz: float
    """Upper end of the band in Hz; infinite without a time axis."""
    turns_freely: bool
    """Whether it is a shaft that makes more than two turns: it has no stiffness, and only the position within a turn
    matters."""
    rotational: bool
    """Whether positions are angles in rad."""


def measure_scales(motions: Sequence[Motion], channel: int, rotational: bool) -> Scales:
    """Measure a channel's motion over the samples to fit of all motions, at least one sample: rms speed, travel and its
    ends, duration."""
    position = np.concatenate([motion.position[motion.fit, channel] for motion in motions])
    velocity = np.concatenate([motion.velocity[motion.fit, channel] for motion in motions])
    low, high = float(position.min()), float(position.max())
    duration_s = sum(int(motion.fit.sum()) for motion in motions) / motions[0].rate_hz
    speed = float(np.sqrt(np.mean(velocity**2)))
    turns_freely = rotational and high - low > 4 * np.pi
    return Scales(speed, high - low, low, high, duration_s, motions[0].band_hz, turns_freely, rotational)


def compute_relative_time(motion: Motion) -> FloatArray:
    """Compute (n, 1): time within the recorded part, scaled to rise linearly from -1 to 1."""
    return np.linspace(-1.0, 1.0, len(motion.force))[:, None]


def smooth_sign(velocity: FloatArray, width: float) -> FloatArray:
    """Compute tanh(velocity / width): the sign of a velocity, continuous about zero. width: above 0, in the velocity's
    unit."""
    return np.asarray(np.tanh(velocity / width))


def make_contact_columns(channel: int, end: float, side: float) -> Columns:
    """Make the function for the column (samples, 1) of a contact towards `side` (+1 or -1), whose depth at the end of
    the travel is n[0], m (rad): the penetration, with the sign of `side`. The depth is refined by factors, which would
    change a position near zero too little and one far from it too much."""
    return lambda motion, n: side * np.maximum(side * (motion.position[:, [channel]] - end) + n[0], 0.0)


def name_weights(*names: str) -> WeightConverter:
    """Make a `WeightConverter` that gives the weights these names, in their order, with either sign."""
    return lambda w, n, mass: dict(zip(names, map(float, w), strict=True))


def name_positive_weight(name: str) -> WeightConverter:
    """Make a `WeightConverter` that gives a single weight this name; it returns None unless the weight is positive."""
    return lambda w, n, mass: {name: float(w[0])} if w[0] > 0 else None


def filter_from_rest(
    samples: FloatArray, rate_hz: float, transfer_function: Callable[[FloatArray], FloatArray]
) -> FloatArray:
    """Filter samples (n, k) by a linear filter that starts from rest. transfer_function: of the continuous filter, at
    s = i omega (lines,) with omega in rad/s. Computed by FFT, zero-padded to twice the length so that the filter's
    memory, which must be shorter than the samples, does not wrap round."""
    sample_count = len(samples)
    padded_length = next_fast_len(2 * sample_count, real=True)
    spectrum = rfft(samples, padded_length, axis=0)
    s = 2j * np.pi * rfftfreq(padded_length, 1 / rate_hz)
    return np.asarray(irfft(transfer_function(s)[:, None] * spectrum, padded_length, axis=0)[:sample_count])
