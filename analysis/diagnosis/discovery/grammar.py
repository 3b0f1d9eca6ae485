"""The grammar of discovered laws: terms of the motion and the commands, with free parameters.

A term is a shape times a factor; its free parameters (exponents, widths, time constants, pitches) start on a grid that
spans the recording's travel, speed and duration. Forces linear in an axis's own motion are not terms: mass, damping and
stiffness are parameters of the model. docs/diagnosis.md lists what the grammar contains and what it does not.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from equalizer.signals.signal import FloatArray

Columns = Mapping[str, FloatArray]
"""Along a recording, (n,) each, SI: x, y, z and vx, … the axes' motion, fx, … the commands, ax, … the readings, t."""
AXES = "xyz"
_SIGNAL = re.compile(rf"\b(?:[vfa]?[{AXES}]|t)\b")


@dataclass(frozen=True, slots=True)
class Term:
    """A term of a discovered law: a formula with free parameters, their starting values and bounds. Its factor is
    fitted separately."""

    shape: str
    """Formula in the language of laws; its free parameters are p0, p1, …"""
    numbers: tuple[float, ...] = ()
    """Starting values of the free parameters."""
    bounds: tuple[tuple[float, float], ...] = ()
    exponents: tuple[int, ...] = ()
    """Indices of the parameters that are exponents."""
    angles: tuple[int, ...] = ()
    """Indices of the parameters that are angles; all others are positive."""
    family: str = ""
    """Shapes of one family differ by an integer exponent; where one ranks high, all are fitted. Empty: the shape
    itself."""

    @property
    def variables(self) -> frozenset[str]:
        """Signals in the formula, by the names of `Columns`."""
        return frozenset(_SIGNAL.findall(self.shape))


def odd_power(name: str, number: int) -> str:
    """Formula of an odd power of a signal, abs(x)^p sign(x). number: index of the free exponent."""
    return f"abs({name})**p{number}*sign({name})"


def even_power(name: str, number: int) -> str:
    """Formula of an even power of a signal, abs(x)^p. number: index of the free exponent."""
    return f"abs({name})**p{number}"


POWER = (0.15, 6.0)
"""Bounds of an exponent: beyond, a power is a step or a wall."""


@dataclass(frozen=True, slots=True)
class Axis:
    """One axis's names and the sizes of its signals in a recording."""

    x: str
    v: str
    f: str
    travel: float
    speed: float
    force: float


def axes_of(columns: Columns, count: int) -> tuple[Axis, ...]:
    """The first `count` axes with the largest magnitudes of their position, velocity and force."""

    def largest(name: str) -> float:
        return max(float(np.abs(columns[name]).max()), 1e-12)

    return tuple(Axis(a, f"v{a}", f"f{a}", largest(a), largest(f"v{a}"), largest(f"f{a}")) for a in AXES[:count])


def terms_of(axes: Sequence[Axis], axis_index: int, duration_s: float, rate_hz: float) -> tuple[Term, ...]:
    """All terms of a force along one axis, except the periodic ones (`periodic_terms`). duration_s: the recording's
    length."""
    own_axis, other_axes = axes[axis_index], [axis for number, axis in enumerate(axes) if number != axis_index]
    terms = (
        *_powers(own_axis), *_products(own_axis), *_hinges(own_axis), *_saturations(own_axis), *_poles(own_axis),
        *_memory(own_axis, other_axes, duration_s, rate_hz), *_cross_axis(own_axis, other_axes),
        *_drifts(own_axis, duration_s),
    )  # fmt: skip
    return tuple(terms)


def _powers(own_axis: Axis) -> Iterator[Term]:
    yield Term(f"sign({own_axis.v})")
    for name, starts in ((own_axis.v, (0.25, 0.5, 1.5, 2.0, 3.0, 5.0)), (own_axis.x, (0.5, 1.5, 2.0, 3.0, 5.0)),
                         (own_axis.f, (0.5, 1.5, 2.0, 3.0, 5.0))):  # fmt: skip
        for start in starts:
            yield Term(odd_power(name, 0), (start,), (POWER,), (0,))
        for start in (1.0, 2.0, 4.0):
            yield Term(even_power(name, 0), (start,), (POWER,), (0,))


def _products(own_axis: Axis) -> Iterator[Term]:
    """Products of position and speed, and of position or speed with the command."""
    for (x_power, v_power), a, b in product(
        product((odd_power, even_power), (odd_power, even_power)), (1.0, 2.0), (1.0, 2.0)
    ):
        yield Term(f"{x_power(own_axis.x, 0)}*{v_power(own_axis.v, 1)}", (a, b), (POWER, POWER), (0, 1))
    for shape, start in product((odd_power, even_power), (1.0, 2.0)):
        yield Term(f"{shape(own_axis.x, 0)}*sign({own_axis.v})", (start,), (POWER,), (0,))
        for force_factor, name in product((own_axis.f, f"abs({own_axis.f})"), (own_axis.x, own_axis.v)):
            yield Term(f"{shape(name, 0)}*{force_factor}", (start,), (POWER,), (0,))


def _hinges(own_axis: Axis) -> Iterator[Term]:
    for share in (0.2, 0.4, 0.6, 0.8):
        edge, widest = share * own_axis.travel, (0.0, own_axis.travel)
        for side in (own_axis.x, f"(-{own_axis.x})"):
            yield Term(f"maximum({side} - p0, 0)**p1", (edge, 1.0), (widest, POWER), (1,))
            yield Term(f"maximum(sign({side} - p0), 0)*{own_axis.v}", (edge,), (widest,))
        yield Term(f"maximum(abs({own_axis.x}) - p0, 0)**p1*sign({own_axis.x})", (edge, 1.0), (widest, POWER), (1,))
        yield Term(
            f"maximum(abs({own_axis.v}) - p0, 0)*sign({own_axis.v})",
            (share * own_axis.speed,),
            ((0.0, own_axis.speed),),
        )


def _saturations(own_axis: Axis) -> Iterator[Term]:
    for (name, size), share in product(
        ((own_axis.v, own_axis.speed), (own_axis.x, own_axis.travel)), (0.03, 0.1, 0.3, 1.0)
    ):
        width = (share * size,), ((1e-3 * size, 10 * size),)
        yield Term(f"tanh({name}/p0)", *width)
        yield Term(f"atan({name}/p0)", *width)
        yield Term(f"{name}/(1 + abs({name})/p0)", *width)
        yield Term(f"{name}/(1 + ({name}/p0)**2)", *width)
        yield Term(f"{name}*exp(-({name}/p0)**2)", *width)
    yield from soft_limit_terms(own_axis.f, own_axis.force)


def soft_limit_terms(name: str, size: float) -> Iterator[Term]:
    """Soft limits of a command or a reading, minus the signal itself, so that small signals are unchanged: no parameter
    of the model could compensate for a gain. size: its largest magnitude."""
    for curve, share in product(("tanh({0}/p0)*p0", "atan({0}/p0)*p0", "{0}/(1 + abs({0})/p0)"), (0.2, 0.5, 1.0, 2.0)):
        yield Term(f"({curve.format(name)} - {name})", (share * size,), ((1e-2 * size, 20 * size),))


def _poles(own_axis: Axis) -> Iterator[Term]:
    """Inverse powers of the distance to a position that the axis never reached, with or without their value at zero.
    Integer exponents are fitted separately, because a free exponent is strongly correlated with the position."""
    pole_bounds = (1.02 * own_axis.travel, 20 * own_axis.travel)
    for share, power, side in product((1.15, 1.5, 2.5), (1, 2, 3), (own_axis.x, f"(-{own_axis.x})")):
        integer_shape = f"(1/abs(p0 - {side})**{power} - 1/p0**{power})"
        yield Term(integer_shape, (share * own_axis.travel,), (pole_bounds,), family=f"pole of {side}")
        for shape in (f"(1/abs(p0 - {side})**p1 - 1/p0**p1)", f"1/abs(p0 - {side})**p1"):
            yield Term(shape, (share * own_axis.travel, float(power)), (pole_bounds, POWER), (1,))


def _memory(own_axis: Axis, other_axes: Sequence[Axis], duration_s: float, rate_hz: float) -> Iterator[Term]:
    shortest, longest = 1 / rate_hz, duration_s
    for tau in np.geomspace(2 * shortest, max(min(8.0, duration_s / 4), 4 * shortest), 8).tolist():
        bounds = ((shortest, longest),)
        for name in (own_axis.x, own_axis.v, own_axis.f):
            yield Term(f"lag({name}, p0)", (tau,), bounds)
    for tau in np.geomspace(0.1, max(duration_s / 3, 0.2), 5).tolist():
        for name, squared in ((own_axis.f, own_axis.f), (own_axis.x, own_axis.x), (own_axis.v, own_axis.v)):
            yield Term(f"{name}*lag({squared}**2, p0)", (tau,), ((shortest, 10 * longest),))
    for share in (0.03, 0.1, 0.2, 0.4, 0.7):
        yield Term(f"play({own_axis.x}, p0)", (share * own_axis.travel,), ((1e-3 * own_axis.travel, own_axis.travel),))
    for delay_s in (2 * shortest, 5 * shortest, 0.01, 0.03):
        for name in (own_axis.x, own_axis.f):
            yield Term(f"delay({name}, p0)", (delay_s,), ((0.5 * shortest, 0.2),))
    yield Term(f"integral({own_axis.x})")


def _cross_axis(own_axis: Axis, other_axes: Sequence[Axis]) -> Iterator[Term]:
    """Terms of another axis's motion or command."""
    x, v, f = own_axis.x, own_axis.v, own_axis.f
    for k in other_axes:
        shapes = (
            k.v, k.x, k.f, f"{x}*{k.x}", f"{k.x}**2", f"{v}*{k.x}", f"{v}*abs({k.x})", f"{v}*{k.x}**2", f"{x}**2*{k.x}",
            f"{x}*{k.v}", f"{v}*{k.v}", f"{k.v}*abs({v})", f"{k.v}**2", f"{k.v}*abs({k.v})", f"{v}*abs({k.v})",
            f"{x}*{k.x}**2", f"{k.x}*{k.v}", f"sign({k.v})", f"{k.f}*{x}", f"{f}*{k.x}", f"{f}*{k.f}", f"{k.x}**3",
            f"{x}*{k.v}**2", f"{k.x}*{k.v}**2",
        )  # fmt: skip
        yield from (Term(shape) for shape in shapes)
    for first, second in product(other_axes, other_axes):
        if first.x < second.x:
            yield from (Term(f"{a}*{b}") for a, b in product((first.x, first.v), (second.x, second.v)))
    if other_axes:
        speed = " + ".join(f"{axis.v}**2" for axis in (own_axis, *other_axes))
        yield Term(f"sqrt({speed})*{v}")


def _drifts(own_axis: Axis, duration_s: float) -> Iterator[Term]:
    yield from (Term(f"{name}*t") for name in (own_axis.x, own_axis.v, own_axis.f))
    yield Term("t")


def periodic_terms(columns: Columns, own_axis: Axis, missing_force: FloatArray, rate_hz: float) -> tuple[Term, ...]:
    """Sines of the position or of time, at the strongest spectral lines of `missing_force` (n,), alone or times
    speed, position or command; and long pitches, which hardly make a line. At least one pitch is travelled."""
    x = columns[own_axis.x]
    stride = max(len(x) // 8000, 1)
    wave_numbers = np.arange(1.0, 40.0, 0.175) / own_axis.travel
    phasors = np.exp(-2j * np.pi * np.outer(x[::stride], wave_numbers)).astype(np.complex64)
    terms = []
    travel = float(np.ptp(x))
    for name, wave_count, angle in product(
        ("", own_axis.f, own_axis.v), np.geomspace(1.0, 12.0, 13).tolist(), (0.0, np.pi / 2)
    ):
        pitch = travel / wave_count
        terms.append(_wave(name, f"{own_axis.x}/p0", pitch, (0.5 * pitch, min(2 * pitch, travel)), angle))
    for name in ("", own_axis.f, own_axis.v):
        weight = columns[name] if name else np.ones_like(x)
        lines = (missing_force * weight)[::stride].astype(np.complex64) @ phasors
        for k in _peaks(np.abs(lines), 2):
            pitch = 1 / float(wave_numbers[k])
            bounds = (0.5 * pitch, min(2 * pitch, travel))
            terms.append(_wave(name, f"{own_axis.x}/p0", pitch, bounds, _angle(lines[k])))
    for name in (own_axis.x, own_axis.v, own_axis.f):
        length = 4 * len(x)  # Zero-padded: a start half a line off is out of phase by the end.
        lines = np.fft.rfft(missing_force * columns[name], length)
        lines[: int(_SLOWEST_LINE_HZ * length / rate_hz) + 1] = 0
        k = int(np.argmax(np.abs(lines)))
        hz = max(k, 1) * rate_hz / length
        terms.append(_wave(name, "p0*t", hz, (0.8 * hz, 1.2 * hz), _angle(lines[k])))
    return tuple(terms)


_SLOWEST_LINE_HZ = 0.1


def _wave(weight: str, phase: str, number: float, bounds: tuple[float, float], angle: float) -> Term:
    shape = f"sin(2*pi*{phase} + p1)"
    return Term(f"{weight}*{shape}" if weight else shape, (number, angle), (bounds, (-20.0, 20.0)), (), (1,))


def _angle(line: complex) -> float:
    return float(np.angle(line) + np.pi / 2)


def _peaks(power: FloatArray, max_count: int) -> list[int]:
    peaks = [k for k in range(2, len(power) - 2) if power[k] == power[k - 2 : k + 3].max()]
    return sorted(peaks, key=lambda k: -power[k])[:max_count]
