"""The grammar of discovered laws: terms of the motion and the commands, with free parameters.

A term is a shape times a factor; its free parameters (exponents, widths, time constants, pitches) start on a grid that
the recording's own travel, speed and duration span. What is linear in an axis's own motion is no term: mass, damping
and stiffness are parameters of the model. docs/diagnosis.md says what the grammar holds and what it does not.
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
    """A term of a discovered law: a formula with free parameters, where they start, and their bounds; its factor is
    fitted apart."""

    shape: str
    """Formula in the language of laws; its free parameters are p0, p1, …"""
    numbers: tuple[float, ...] = ()
    """Where they start."""
    bounds: tuple[tuple[float, float], ...] = ()
    exponents: tuple[int, ...] = ()
    """Which of them are exponents."""
    turns: tuple[int, ...] = ()
    """Which of them are angles: all others are positive."""
    family: str = ""
    """Shapes of one family differ by a whole exponent: one of them ranked high, all are fitted. Empty: the shape."""

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


def terms_of(axes: Sequence[Axis], at: int, seconds: float, rate_hz: float) -> tuple[Term, ...]:
    """All terms of a force along axis `at`, but the periodic ones (`periodic_terms`). seconds: the recording's
    length."""
    own, others = axes[at], [axis for number, axis in enumerate(axes) if number != at]
    every = (
        *_powers(own), *_products(own), *_hinges(own), *_saturations(own), *_poles(own),
        *_memory(own, others, seconds, rate_hz), *_cross_axis(own, others), *_drifts(own, seconds),
    )  # fmt: skip
    return tuple(every)


def _powers(of: Axis) -> Iterator[Term]:
    yield Term(f"sign({of.v})")
    for name, starts in ((of.v, (0.25, 0.5, 1.5, 2.0, 3.0, 5.0)), (of.x, (0.5, 1.5, 2.0, 3.0, 5.0)),
                         (of.f, (0.5, 1.5, 2.0, 3.0, 5.0))):  # fmt: skip
        for start in starts:
            yield Term(odd_power(name, 0), (start,), (POWER,), (0,))
        for start in (1.0, 2.0, 4.0):
            yield Term(even_power(name, 0), (start,), (POWER,), (0,))


def _products(of: Axis) -> Iterator[Term]:
    """Products of position and speed, and of position or speed with the command."""
    for (left, right), a, b in product(
        product((odd_power, even_power), (odd_power, even_power)), (1.0, 2.0), (1.0, 2.0)
    ):
        yield Term(f"{left(of.x, 0)}*{right(of.v, 1)}", (a, b), (POWER, POWER), (0, 1))
    for shape, start in product((odd_power, even_power), (1.0, 2.0)):
        yield Term(f"{shape(of.x, 0)}*sign({of.v})", (start,), (POWER,), (0,))
        for of_force, name in product((of.f, f"abs({of.f})"), (of.x, of.v)):
            yield Term(f"{shape(name, 0)}*{of_force}", (start,), (POWER,), (0,))


def _hinges(of: Axis) -> Iterator[Term]:
    for share in (0.2, 0.4, 0.6, 0.8):
        edge, widest = share * of.travel, (0.0, of.travel)
        for side in (of.x, f"(-{of.x})"):
            yield Term(f"maximum({side} - p0, 0)**p1", (edge, 1.0), (widest, POWER), (1,))
            yield Term(f"maximum(sign({side} - p0), 0)*{of.v}", (edge,), (widest,))
        yield Term(f"maximum(abs({of.x}) - p0, 0)**p1*sign({of.x})", (edge, 1.0), (widest, POWER), (1,))
        yield Term(f"maximum(abs({of.v}) - p0, 0)*sign({of.v})", (share * of.speed,), ((0.0, of.speed),))


def _saturations(of: Axis) -> Iterator[Term]:
    for (name, size), share in product(((of.v, of.speed), (of.x, of.travel)), (0.03, 0.1, 0.3, 1.0)):
        width = (share * size,), ((1e-3 * size, 10 * size),)
        yield Term(f"tanh({name}/p0)", *width)
        yield Term(f"atan({name}/p0)", *width)
        yield Term(f"{name}/(1 + abs({name})/p0)", *width)
        yield Term(f"{name}/(1 + ({name}/p0)**2)", *width)
        yield Term(f"{name}*exp(-({name}/p0)**2)", *width)
    yield from bent_terms(of.f, of.force)


def bent_terms(name: str, size: float) -> Iterator[Term]:
    """Soft limits of a command or a reading, less itself, so that small signals pass unchanged: the model's parameters
    hold no gain that could make up for it. size: its largest value."""
    for curve, share in product(("tanh({0}/p0)*p0", "atan({0}/p0)*p0", "{0}/(1 + abs({0})/p0)"), (0.2, 0.5, 1.0, 2.0)):
        yield Term(f"({curve.format(name)} - {name})", (share * size,), ((1e-2 * size, 20 * size),))


def _poles(of: Axis) -> Iterator[Term]:
    """Inverse powers of the distance to a position that the axis never reached, with or without their value at zero. A
    free exponent trades against the position in a narrow valley, so that whole ones are fitted for themselves."""
    beyond = (1.02 * of.travel, 20 * of.travel)
    for share, power, side in product((1.15, 1.5, 2.5), (1, 2, 3), (of.x, f"(-{of.x})")):
        whole = f"(1/abs(p0 - {side})**{power} - 1/p0**{power})"
        yield Term(whole, (share * of.travel,), (beyond,), family=f"pole of {side}")
        for shape in (f"(1/abs(p0 - {side})**p1 - 1/p0**p1)", f"1/abs(p0 - {side})**p1"):
            yield Term(shape, (share * of.travel, float(power)), (beyond, POWER), (1,))


def _memory(of: Axis, others: Sequence[Axis], seconds: float, rate_hz: float) -> Iterator[Term]:
    shortest, longest = 1 / rate_hz, seconds
    for tau in np.geomspace(2 * shortest, max(min(8.0, seconds / 4), 4 * shortest), 8).tolist():
        bounds = ((shortest, longest),)
        for name in (of.x, of.v, of.f):
            yield Term(f"lag({name}, p0)", (tau,), bounds)
    for tau in np.geomspace(0.1, max(seconds / 3, 0.2), 5).tolist():
        for name, squared in ((of.f, of.f), (of.x, of.x), (of.v, of.v)):
            yield Term(f"{name}*lag({squared}**2, p0)", (tau,), ((shortest, 10 * longest),))
    for share in (0.03, 0.1, 0.2, 0.4, 0.7):
        yield Term(f"play({of.x}, p0)", (share * of.travel,), ((1e-3 * of.travel, of.travel),))
    for late in (2 * shortest, 5 * shortest, 0.01, 0.03):
        for name in (of.x, of.f):
            yield Term(f"delay({name}, p0)", (late,), ((0.5 * shortest, 0.2),))
    yield Term(f"integral({of.x})")


def _cross_axis(of: Axis, others: Sequence[Axis]) -> Iterator[Term]:
    """Terms of another axis's motion or command."""
    x, v, f = of.x, of.v, of.f
    for k in others:
        shapes = (
            k.v, k.x, k.f, f"{x}*{k.x}", f"{k.x}**2", f"{v}*{k.x}", f"{v}*abs({k.x})", f"{v}*{k.x}**2", f"{x}**2*{k.x}",
            f"{x}*{k.v}", f"{v}*{k.v}", f"{k.v}*abs({v})", f"{k.v}**2", f"{k.v}*abs({k.v})", f"{v}*abs({k.v})",
            f"{x}*{k.x}**2", f"{k.x}*{k.v}", f"sign({k.v})", f"{k.f}*{x}", f"{f}*{k.x}", f"{f}*{k.f}", f"{k.x}**3",
            f"{x}*{k.v}**2", f"{k.x}*{k.v}**2",
        )  # fmt: skip
        yield from (Term(shape) for shape in shapes)
    for first, second in product(others, others):
        if first.x < second.x:
            yield from (Term(f"{a}*{b}") for a, b in product((first.x, first.v), (second.x, second.v)))
    if others:
        speed = " + ".join(f"{axis.v}**2" for axis in (of, *others))
        yield Term(f"sqrt({speed})*{v}")


def _drifts(of: Axis, seconds: float) -> Iterator[Term]:
    yield from (Term(f"{name}*t") for name in (of.x, of.v, of.f))
    yield Term("t")


def periodic_terms(columns: Columns, own: Axis, left: FloatArray, rate_hz: float) -> tuple[Term, ...]:
    """Sines of the position or of time, at the strongest spectral lines of the missing force `left` (n,), alone or
    times speed, position or command; and long pitches, which hardly make a line. At least one pitch is travelled."""
    x = columns[own.x]
    every = max(len(x) // 8000, 1)
    waves = np.arange(1.0, 40.0, 0.175) / own.travel
    turns = np.exp(-2j * np.pi * np.outer(x[::every], waves)).astype(np.complex64)
    found = []
    travelled = float(np.ptp(x))
    for name, wave, angle in product(("", own.f, own.v), np.geomspace(1.0, 12.0, 13).tolist(), (0.0, np.pi / 2)):
        pitch = travelled / wave
        found.append(_wave(name, f"{own.x}/p0", pitch, (0.5 * pitch, min(2 * pitch, travelled)), angle))
    for name in ("", own.f, own.v):
        weight = columns[name] if name else np.ones_like(x)
        lines = (left * weight)[::every].astype(np.complex64) @ turns
        for k in _peaks(np.abs(lines), 2):
            pitch = 1 / float(waves[k])
            bounds = (0.5 * pitch, min(2 * pitch, travelled))
            found.append(_wave(name, f"{own.x}/p0", pitch, bounds, _angle(lines[k])))
    for name in (own.x, own.v, own.f):
        length = 4 * len(x)  # Zero-padded: a start half a line off is out of phase by the end.
        lines = np.fft.rfft(left * columns[name], length)
        lines[: int(_SLOWEST_LINE_HZ * length / rate_hz) + 1] = 0
        k = int(np.argmax(np.abs(lines)))
        hz = max(k, 1) * rate_hz / length
        found.append(_wave(name, "p0*t", hz, (0.8 * hz, 1.2 * hz), _angle(lines[k])))
    return tuple(found)


_SLOWEST_LINE_HZ = 0.1


def _wave(weight: str, phase: str, number: float, bounds: tuple[float, float], angle: float) -> Term:
    shape = f"sin(2*pi*{phase} + p1)"
    return Term(f"{weight}*{shape}" if weight else shape, (number, angle), (bounds, (-20.0, 20.0)), (), (1,))


def _angle(line: complex) -> float:
    return float(np.angle(line) + np.pi / 2)


def _peaks(power: FloatArray, most: int) -> list[int]:
    peaks = [k for k in range(2, len(power) - 2) if power[k] == power[k - 2 : k + 3].max()]
    return sorted(peaks, key=lambda k: -power[k])[:most]
