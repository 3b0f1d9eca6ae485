"""Concealed laws of the blind test: formulas outside the catalogue, with parameters drawn anew for each device.

They test whether the diagnosis discovers a law that it does not know. They share no code with its grammar of laws, and
some have shapes that the grammar cannot express. The label of a law states on what it acts, which variables it needs,
and whether it has a memory, so that an answer can be judged without comparing formulas.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from equalizer.signals.signal import FloatArray
from study.evaluation.challenge import law_kernel as kernel

Random = np.random.Generator
ActsOn = Literal["force", "command", "response"]
"""Quantity that a law changes: the force on the handle, the command, or the sensor's reading."""


@dataclass(frozen=True, slots=True)
class Sizes:
    """Largest travel, speed, reading and force of an axis without the law."""

    travel_m: float
    speed_mps: float
    reading_mps2: float
    force_n: float = 3.0


@dataclass(frozen=True, slots=True)
class LawKind:
    """One family of laws, and how its parameters are drawn."""

    name: str
    formula: str
    """For a reader; k is the size, a and b parameters, s a sign; x and v are position and velocity along its axis, y is
    another axis, u the command, r the reading; lag(x, a) is x behind a first-order low-pass of time constant a (s)."""
    draw: Callable[[Random, Sizes], tuple[float, float]]
    """Draws a and b."""
    variables: tuple[str, ...]
    """Equivalent sets of variables, each separated by spaces."""
    code: int = -1
    """Code in `law_kernel`, for forces."""
    acts_on: tuple[ActsOn, ...] = ("force",)
    """Equivalent places of action."""
    memory: bool = False
    """Whether the force depends on earlier motion or commands."""
    axes: int = 1
    """Number of axes in the formula."""
    mutual: bool = False
    """Whether the law acts on the other axis as well."""
    change: Callable[[FloatArray, FloatArray, float, float], FloatArray] | None = None
    """For laws of commands or readings: the change for k = 1, from values of its own axis and of another, a and b."""


def _draw_simple_or_any(random: Random, simple: tuple[float, ...], low: float, high: float) -> float:
    """Draw, with equal probability, one of the simple numbers or any number in the range."""
    return float(random.choice(simple)) if random.random() < 0.5 else float(random.uniform(low, high))


def _draw_nothing(random: Random, sizes: Sizes) -> tuple[float, float]:
    """The formula has no parameters."""
    return 0.0, 0.0


def _draw_speed_power(random: Random, sizes: Sizes) -> tuple[float, float]:
    """a: exponent of the speed."""
    return _draw_simple_or_any(random, (1.5, 3.0), 1.3, 3.2), 0.0


def _draw_place_power(random: Random, sizes: Sizes) -> tuple[float, float]:
    """a: exponent of the position."""
    return _draw_simple_or_any(random, (1.5, 2.0, 5.0), 1.4, 4.0), 0.0


def _draw_low_power(random: Random, sizes: Sizes) -> tuple[float, float]:
    """a: exponent, 1 or 2."""
    return float(random.choice((1.0, 2.0))), 0.0


def _draw_pitch(random: Random, sizes: Sizes) -> tuple[float, float]:
    """a: spatial period (m), a part of the travel; b: phase (rad)."""
    return sizes.travel_m * random.uniform(0.3, 0.9), random.uniform(-np.pi, np.pi)


def _draw_pump(random: Random, sizes: Sizes) -> tuple[float, float]:
    """a: frequency (Hz); b: phase (rad)."""
    return random.uniform(0.5, 6.0), random.uniform(-np.pi, np.pi)


def _draw_magnet(random: Random, sizes: Sizes) -> tuple[float, float]:
    """a: distance of the attracting body (m), beyond the travel; b: exponent."""
    return sizes.travel_m * random.uniform(1.4, 2.2), float(random.choice((1.0, 2.0, 3.0)))


def _draw_fast_time(random: Random, sizes: Sizes) -> tuple[float, float]:
    """a: time constant (s), 8 ms to 0.4 s, log-uniform."""
    return float(np.exp(random.uniform(np.log(0.008), np.log(0.4)))), 0.0


def _draw_slow_time(random: Random, sizes: Sizes) -> tuple[float, float]:
    """a: time constant (s), 0.4 s to 4 s."""
    return random.uniform(0.4, 4.0), 0.0


def _draw_speed(random: Random, sizes: Sizes) -> tuple[float, float]:
    """a: speed (m/s), a part of the largest."""
    return sizes.speed_mps * random.uniform(0.1, 0.5), 0.0


def _draw_travel(random: Random, sizes: Sizes) -> tuple[float, float]:
    """a: position (m), a part of the largest; b: exponent 1.5, which a contact uses (Hertz)."""
    return sizes.travel_m * random.uniform(0.1, 0.5), 1.5


def _draw_force(random: Random, sizes: Sizes) -> tuple[float, float]:
    """a: force (N), a part of the largest."""
    return sizes.force_n * random.uniform(0.3, 0.8), 0.0


def _draw_reading(random: Random, sizes: Sizes) -> tuple[float, float]:
    """a: acceleration (m/s²), a part of the largest."""
    return sizes.reading_mps2 * random.uniform(0.3, 0.8), 0.0


def _force_law(  # noqa: PLR0913 - the columns of the table below
    name: str, formula: str, code: int, draw: Callable[[Random, Sizes], tuple[float, float]],
    *variables: str, axes: int = 1, memory: bool = False, mutual: bool = False,
) -> LawKind:  # fmt: skip
    """A family of laws that add a force."""
    return LawKind(name, formula, draw, variables, code, memory=memory, axes=axes, mutual=mutual)


LAW_KINDS: tuple[LawKind, ...] = (
    _force_law("drag of a power", "-k |v|^a sgn v", kernel.SPEED_POWER, _draw_speed_power, "vx"),
    _force_law("spring of a power", "-k |x|^a sgn x", kernel.PLACE_POWER, _draw_place_power, "x"),
    _force_law("drag that grows with the place", "-k |x|^a v", kernel.PLACE_DRAG, _draw_low_power, "x vx"),
    _force_law("spring that grows with the speed", "-s k x |v|^a", kernel.SPEED_SPRING, _draw_low_power, "x vx"),
    _force_law("gain that ripples", "k u sin(2 pi x / a + b)", kernel.GAIN_RIPPLE, _draw_pitch, "fx x"),
    _force_law("pumped stiffness", "-k x sin(2 pi a t + b)", kernel.PUMPED, _draw_pump, "t x"),
    _force_law("attraction", "s k (1 / (a - s x)^b - 1 / a^b)", kernel.ATTRACTION, _draw_magnet, "x"),
    _force_law("relaxation", "-k (x - lag(x, a))", kernel.RELAXATION, _draw_fast_time, "x", "vx", memory=True),
    _force_law("heating gain", "-k u lag(u^2, a)", kernel.HEATING, _draw_slow_time, "fx", memory=True),
    _force_law("soft drag", "-k tanh(v / a)", kernel.SOFT_DRAG, _draw_speed, "vx"),
    _force_law("soft spring", "-k atan(x / a)", kernel.SOFT_SPRING, _draw_travel, "x"),
    _force_law("fading drag", "-k v / (1 + (v / a)^2)", kernel.FADING_DRAG, _draw_speed, "vx"),
    _force_law("contact on one side", "-s k max(s x - a, 0)^b", kernel.CONTACT, _draw_travel, "x"),
    _force_law("drag beyond a place", "-k v where s x > a", kernel.EDGE_DRAG, _draw_travel, "x vx"),
    _force_law("square of another axis", "-s k y^2", kernel.CROSS_SQUARE, _draw_nothing, "y", axes=2),
    _force_law("spring that another axis stiffens", "-k x y^2", kernel.CROSS_SPRING, _draw_nothing, "x y", axes=2),
    _force_law("drag that another axis makes", "-k vx |vy|", kernel.CROSS_DRAG, _draw_nothing, "vx vy", axes=2),
    _force_law("gyroscopic", "s k vy, on the other -s k vx", kernel.WHIRL, _draw_nothing, "vy", axes=2, mutual=True),
    _force_law("drag along the path", "-k |v| v of both axes", kernel.ALL_DRAG, _draw_nothing, "vx vy", axes=2,
               mutual=True),
    LawKind("soft amplifier", "a tanh(u / a)", _draw_force, ("fx",), acts_on=("command", "force"),
            change=lambda u, cross, a, b: a * np.tanh(u / a) - u),
    LawKind("amplifier of two gains", "u + s k |u|", _draw_nothing, ("fx",), acts_on=("command", "force"),
            change=lambda u, cross, a, b: np.abs(u)),
    LawKind("bent amplifier", "u + s k u |u|", _draw_nothing, ("fx",), acts_on=("command", "force"),
            change=lambda u, cross, a, b: u * np.abs(u)),
    LawKind("crooked sensor", "r + s k r^2", _draw_nothing, ("ax",), acts_on=("response",),
            change=lambda r, cross, a, b: r * r),
    LawKind("soft sensor", "a atan(r / a)", _draw_reading, ("ax",), acts_on=("response",),
            change=lambda r, cross, a, b: a * np.arctan(r / a) - r),
    LawKind("sensor of two axes", "rx + s k rx ry", _draw_nothing, ("ax ay",), acts_on=("response",), axes=2,
            change=lambda r, cross, a, b: r * cross),
)  # fmt: skip
"""All families of laws; the devices of a bank cycle through them in random order."""
LAW_OF_NAME = {kind.name: kind for kind in LAW_KINDS}
"""Families by name."""
