"""Table of the concealed laws of the blind test: force, command and sensor laws outside the catalogue of effects.

They test whether the diagnosis discovers a law outside its catalogue. They share no code with its grammar of laws, and
some have shapes that the grammar cannot express. The label of a law states on what it acts, which variables it needs,
and whether it has a memory, so that an answer can be judged without comparing formulas. All ranges were chosen by hand.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from equalizer.signals.signal import FloatArray
from study.evaluation.challenge import law_kernel as kernel

Random = np.random.Generator
ActsOn = Literal["force", "command", "response"]
"""Quantity that a law changes: force on the handle, command (force of the drive), or response (sensor's reading)."""


@dataclass(frozen=True, slots=True)
class PeakValues:
    """Peak magnitudes of position, velocity, acceleration and command of an axis, in a recording without the law."""

    travel_m: float
    speed_mps: float
    reading_mps2: float
    force_n: float = 3.0
    """Nominal peak of the commands, for all devices."""


@dataclass(frozen=True, slots=True)
class LawKind:
    """A parametrised law, and how its parameters are drawn."""

    name: str
    formula: str
    """For display. k: size, a and b: parameters, s: sign; x and v: position and velocity along its axis, y: position
    along another axis, vx, vy, rx, ry: velocity and reading by axis, u: command, r: reading, t: time; lag(x, a): x
    after a first-order low pass with the time constant a (s)."""
    draw: Callable[[Random, PeakValues], tuple[float, float]]
    """Draws the parameters a and b, in SI units (phases in rad, frequencies in Hz); one that the formula does not
    contain has no effect."""
    variables: tuple[str, ...]
    """Sets of variables that are all accepted, each separated by spaces: x, y positions, vx, vy velocities, ax,
    ay readings, fx command, t time; x is the law's own axis."""
    code: int = -1
    """Kind of law in `law_kernel`; -1 for laws of commands or readings."""
    acts_on: tuple[ActsOn, ...] = ("force",)
    """Quantities that are all accepted as the one that the law changes."""
    memory: bool = False
    """Whether the force depends on earlier motion or commands."""
    axes: int = 1
    """Number of axes in the formula."""
    mutual: bool = False
    """Whether the law acts on the other axis as well, with x and y exchanged and the opposite sign s."""
    change: Callable[[FloatArray, FloatArray, float, float], FloatArray] | None = None
    """For laws of commands or readings: the change of the signal for k = 1. Arguments: the signal (n,) on the law's own
    axis and on another axis, a, b."""


def _draw_simple_or_uniform(random: Random, simple_numbers: tuple[float, ...], low: float, high: float) -> float:
    """Draw, with equal probability, one of the simple numbers or any number in the range."""
    return float(random.choice(simple_numbers)) if random.random() < 0.5 else float(random.uniform(low, high))


def _draw_zeros(random: Random, peaks: PeakValues) -> tuple[float, float]:
    """Return a = b = 0, for formulas without parameters."""
    return 0.0, 0.0


def _draw_exponent(random: Random, peaks: PeakValues) -> tuple[float, float]:
    """Draw a, an exponent: 1 or 2; b = 0."""
    return float(random.choice((1.0, 2.0))), 0.0


def _draw_speed_scale(random: Random, peaks: PeakValues) -> tuple[float, float]:
    """Draw a, a speed (m/s), 0.1 to 0.5 times the largest; b = 0."""
    return peaks.speed_mps * random.uniform(0.1, 0.5), 0.0


def _draw_position_scale(random: Random, peaks: PeakValues) -> tuple[float, float]:
    """Draw a, a position (m), 0.1 to 0.5 times the largest travel; b = 1.5 is the exponent of a Hertz contact, and
    other laws ignore it."""
    return peaks.travel_m * random.uniform(0.1, 0.5), 1.5


def _make_force_law(  # noqa: PLR0913 - the columns of the table below
    name: str, formula: str, code: int, draw: Callable[[Random, PeakValues], tuple[float, float]],
    *variables: str, axes: int = 1, memory: bool = False, mutual: bool = False,
) -> LawKind:  # fmt: skip
    """Make a law that adds a force, a row of the table below; the arguments are those of `LawKind`."""
    return LawKind(name, formula, draw, variables, code, memory=memory, axes=axes, mutual=mutual)


LAW_KINDS: tuple[LawKind, ...] = (
    _make_force_law("drag of a power", "-k |v|^a sgn v", kernel.SPEED_POWER,
            lambda random, peaks: (_draw_simple_or_uniform(random, (1.5, 3.0), 1.3, 3.2), 0.0), "vx"),
    _make_force_law("spring of a power", "-k |x|^a sgn x", kernel.POSITION_POWER,
            lambda random, peaks: (_draw_simple_or_uniform(random, (1.5, 2.0, 5.0), 1.4, 4.0), 0.0), "x"),
    _make_force_law("drag that grows with the place", "-k |x|^a v", kernel.POSITION_DRAG, _draw_exponent, "x vx"),
    _make_force_law("spring that grows with the speed", "-s k x |v|^a", kernel.SPEED_SPRING, _draw_exponent, "x vx"),
    _make_force_law("gain that ripples", "k u sin(2 pi x / a + b)", kernel.GAIN_RIPPLE,
            lambda random, peaks: (peaks.travel_m * random.uniform(0.3, 0.9), random.uniform(-np.pi, np.pi)), "fx x"),
    _make_force_law("pumped stiffness", "-k x sin(2 pi a t + b)", kernel.PUMPED_STIFFNESS,
            lambda random, peaks: (random.uniform(0.5, 6.0), random.uniform(-np.pi, np.pi)), "t x"),
    _make_force_law("attraction", "s k (1 / (a - s x)^b - 1 / a^b)", kernel.ATTRACTION,
            lambda random, peaks: (peaks.travel_m * random.uniform(1.4, 2.2), float(random.choice((1.0, 2.0, 3.0)))),
            "x"),
    _make_force_law("relaxation", "-k (x - lag(x, a))", kernel.RELAXATION,
            lambda random, peaks: (float(np.exp(random.uniform(np.log(0.008), np.log(0.4)))), 0.0),
            "x", "vx", memory=True),
    _make_force_law("heating gain", "-k u lag(u^2, a)", kernel.HEATING,
            lambda random, peaks: (random.uniform(0.4, 4.0), 0.0), "fx", memory=True),
    _make_force_law("soft drag", "-k tanh(v / a)", kernel.SOFT_DRAG, _draw_speed_scale, "vx"),
    _make_force_law("soft spring", "-k atan(x / a)", kernel.SOFT_SPRING, _draw_position_scale, "x"),
    _make_force_law("fading drag", "-k v / (1 + (v / a)^2)", kernel.FADING_DRAG, _draw_speed_scale, "vx"),
    _make_force_law("contact on one side", "-s k max(s x - a, 0)^b", kernel.CONTACT, _draw_position_scale, "x"),
    _make_force_law("drag beyond a place", "-k v where s x > a", kernel.ONE_SIDED_DRAG, _draw_position_scale, "x vx"),
    _make_force_law("square of another axis", "-s k y^2", kernel.CROSS_SQUARE, _draw_zeros, "y", axes=2),
    _make_force_law("spring that another axis stiffens", "-k x y^2", kernel.CROSS_SPRING, _draw_zeros, "x y", axes=2),
    _make_force_law("drag that another axis makes", "-k vx |vy|", kernel.CROSS_DRAG, _draw_zeros, "vx vy", axes=2),
    _make_force_law("gyroscopic", "s k vy, on the other -s k vx", kernel.GYROSCOPIC, _draw_zeros, "vy", axes=2,
               mutual=True),
    _make_force_law("drag along the path", "-k |v| v of both axes", kernel.PATH_DRAG, _draw_zeros, "vx vy", axes=2,
               mutual=True),
    LawKind("soft amplifier", "a tanh(u / a)",
            lambda random, peaks: (peaks.force_n * random.uniform(0.3, 0.8), 0.0), ("fx",),
            acts_on=("command", "force"), change=lambda u, cross, a, b: a * np.tanh(u / a) - u),
    LawKind("amplifier of two gains", "u + s k |u|", _draw_zeros, ("fx",), acts_on=("command", "force"),
            change=lambda u, cross, a, b: np.abs(u)),
    LawKind("bent amplifier", "u + s k u |u|", _draw_zeros, ("fx",), acts_on=("command", "force"),
            change=lambda u, cross, a, b: u * np.abs(u)),
    LawKind("crooked sensor", "r + s k r^2", _draw_zeros, ("ax",), acts_on=("response",),
            change=lambda r, cross, a, b: r * r),
    LawKind("soft sensor", "a atan(r / a)",
            lambda random, peaks: (peaks.reading_mps2 * random.uniform(0.3, 0.8), 0.0), ("ax",), acts_on=("response",),
            change=lambda r, cross, a, b: a * np.arctan(r / a) - r),
    LawKind("sensor of two axes", "rx + s k rx ry", _draw_zeros, ("ax ay",), acts_on=("response",), axes=2,
            change=lambda r, cross, a, b: r * cross),
)  # fmt: skip
"""All laws. A bank of devices uses each once, in random order, before any is used again."""
LAWS_BY_NAME = {kind.name: kind for kind in LAW_KINDS}
