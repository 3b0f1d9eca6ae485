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


def format_odd_power(name: str, parameter_index: int) -> str:
    """Formula of an odd power of a signal, abs(x)^p sign(x). parameter_index: index of the free exponent."""
    return f"abs({name})**p{parameter_index}*sign({name})"


def format_even_power(name: str, parameter_index: int) -> str:
    """Formula of an even power of a signal, abs(x)^p. parameter_index: index of the free exponent."""
    return f"abs({name})**p{parameter_index}"


POWER_BOUNDS = (0.15, 6.0)
"""Bounds of an exponent: near 0 a power is nearly a step, and a large one nearly an end stop."""


@dataclass(frozen=True, slots=True)
class Axis:
    """Names of one axis's signals, and their largest magnitudes in a recording."""

    x: str
    """Name of the position in `Columns`."""
    v: str
    """Name of the velocity."""
    f: str
    """Name of the command."""
    travel: float
    """Largest magnitude of the position, in m (rad)."""
    speed: float
    """Largest magnitude of the velocity, in m/s (rad/s)."""
    force: float
    """Largest magnitude of the command, in N (N m)."""


def measure_axes(columns: Columns, count: int) -> tuple[Axis, ...]:
    """Names and largest magnitudes of the signals of the first `count` axes, each at least 1e-12."""

    def find_largest(signal_name: str) -> float:
        """Largest magnitude of a signal in its SI unit, at least 1e-12 so that scales are positive."""
        return max(float(np.abs(columns[signal_name]).max()), 1e-12)

    return tuple(
        Axis(
            letter,
            f"v{letter}",
            f"f{letter}",
            find_largest(letter),
            find_largest(f"v{letter}"),
            find_largest(f"f{letter}"),
        )
        for letter in AXES[:count]
    )


def list_terms(axes: Sequence[Axis], axis_index: int, duration_s: float, rate_hz: float) -> tuple[Term, ...]:
    """All terms of a force along one axis, except the periodic ones (`find_periodic_terms`). axes: as of
    `measure_axes`. axis_index: the force's axis. duration_s: length of the recording."""
    own_axis, other_axes = axes[axis_index], [axis for index, axis in enumerate(axes) if index != axis_index]
    terms = (
        *_generate_power_terms(own_axis), *_generate_product_terms(own_axis), *_generate_hinge_terms(own_axis),
        *_generate_saturation_terms(own_axis), *_generate_pole_terms(own_axis),
        *_generate_memory_terms(own_axis, other_axes, duration_s, rate_hz),
        *_generate_cross_axis_terms(own_axis, other_axes), *_generate_drift_terms(own_axis, duration_s),
    )  # fmt: skip
    return tuple(terms)


def _generate_power_terms(axis: Axis) -> Iterator[Term]:
    """Dry friction, and odd and even powers of velocity, position and command with a free exponent."""
    yield Term(f"sign({axis.v})")
    for signal_name, exponents in ((axis.v, (0.25, 0.5, 1.5, 2.0, 3.0, 5.0)), (axis.x, (0.5, 1.5, 2.0, 3.0, 5.0)),
                            (axis.f, (0.5, 1.5, 2.0, 3.0, 5.0))):  # fmt: skip
        for exponent in exponents:
            yield Term(format_odd_power(signal_name, 0), (exponent,), (POWER_BOUNDS,), (0,))
        for exponent in (1.0, 2.0, 4.0):
            yield Term(format_even_power(signal_name, 0), (exponent,), (POWER_BOUNDS,), (0,))


def _generate_product_terms(axis: Axis) -> Iterator[Term]:
    """Products of powers of position and velocity, and of a power of position or velocity with the command."""
    for (x_power, v_power), x_exponent, v_exponent in product(
        product((format_odd_power, format_even_power), (format_odd_power, format_even_power)), (1.0, 2.0), (1.0, 2.0)
    ):
        yield Term(
            f"{x_power(axis.x, 0)}*{v_power(axis.v, 1)}", (x_exponent, v_exponent), (POWER_BOUNDS, POWER_BOUNDS), (0, 1)
        )
    for format_power, exponent in product((format_odd_power, format_even_power), (1.0, 2.0)):
        yield Term(f"{format_power(axis.x, 0)}*sign({axis.v})", (exponent,), (POWER_BOUNDS,), (0,))
        for force_factor, signal_name in product((axis.f, f"abs({axis.f})"), (axis.x, axis.v)):
            yield Term(f"{format_power(signal_name, 0)}*{force_factor}", (exponent,), (POWER_BOUNDS,), (0,))


def _generate_hinge_terms(axis: Axis) -> Iterator[Term]:
    """Forces that begin at an edge: springs and damping beyond a position, dead zones of position and of velocity."""
    for share in (0.2, 0.4, 0.6, 0.8):
        start_edge, edge_bounds = share * axis.travel, (0.0, axis.travel)
        for position in (axis.x, f"(-{axis.x})"):
            yield Term(f"maximum({position} - p0, 0)**p1", (start_edge, 1.0), (edge_bounds, POWER_BOUNDS), (1,))
            yield Term(f"maximum(sign({position} - p0), 0)*{axis.v}", (start_edge,), (edge_bounds,))
        yield Term(
            f"maximum(abs({axis.x}) - p0, 0)**p1*sign({axis.x})", (start_edge, 1.0), (edge_bounds, POWER_BOUNDS), (1,)
        )
        yield Term(f"maximum(abs({axis.v}) - p0, 0)*sign({axis.v})", (share * axis.speed,), ((0.0, axis.speed),))


def _generate_saturation_terms(axis: Axis) -> Iterator[Term]:
    """Saturating and peaked functions of velocity or position, with a free width, and soft limits of the command."""
    for (signal_name, magnitude), share in product(
        ((axis.v, axis.speed), (axis.x, axis.travel)), (0.03, 0.1, 0.3, 1.0)
    ):
        width = (share * magnitude,), ((1e-3 * magnitude, 10 * magnitude),)
        yield Term(f"tanh({signal_name}/p0)", *width)
        yield Term(f"atan({signal_name}/p0)", *width)
        yield Term(f"{signal_name}/(1 + abs({signal_name})/p0)", *width)
        yield Term(f"{signal_name}/(1 + ({signal_name}/p0)**2)", *width)
        yield Term(f"{signal_name}*exp(-({signal_name}/p0)**2)", *width)
    yield from generate_soft_limit_terms(axis.f, axis.force)


def generate_soft_limit_terms(name: str, magnitude: float) -> Iterator[Term]:
    """Soft limits of a command or a reading, minus the signal itself, so that small signals are unchanged: no parameter
    of the model could compensate for a gain. magnitude: the largest of the signal."""
    for curve, share in product(("tanh({0}/p0)*p0", "atan({0}/p0)*p0", "{0}/(1 + abs({0})/p0)"), (0.2, 0.5, 1.0, 2.0)):
        yield Term(f"({curve.format(name)} - {name})", (share * magnitude,), ((1e-2 * magnitude, 20 * magnitude),))


def _generate_pole_terms(axis: Axis) -> Iterator[Term]:
    """Inverse powers of the distance to a position that the axis never reached, with or without their value at zero.
    Integer exponents are fitted separately, because a free exponent is strongly correlated with the position."""
    pole_bounds = (1.02 * axis.travel, 20 * axis.travel)
    for share, power, position in product((1.15, 1.5, 2.5), (1, 2, 3), (axis.x, f"(-{axis.x})")):
        integer_shape = f"(1/abs(p0 - {position})**{power} - 1/p0**{power})"
        yield Term(integer_shape, (share * axis.travel,), (pole_bounds,), family=f"pole of {position}")
        for shape in (f"(1/abs(p0 - {position})**p1 - 1/p0**p1)", f"1/abs(p0 - {position})**p1"):
            yield Term(shape, (share * axis.travel, float(power)), (pole_bounds, POWER_BOUNDS), (1,))


def _generate_memory_terms(axis: Axis, other_axes: Sequence[Axis], duration_s: float, rate_hz: float) -> Iterator[Term]:
    """Terms with memory: first-order lags, thermal drift of gains, play, delays and the integral of the position."""
    shortest_s, longest_s = 1 / rate_hz, duration_s
    for time_constant_s in np.geomspace(2 * shortest_s, max(min(8.0, duration_s / 4), 4 * shortest_s), 8).tolist():
        bounds = ((shortest_s, longest_s),)
        for signal_name in (axis.x, axis.v, axis.f):
            yield Term(f"lag({signal_name}, p0)", (time_constant_s,), bounds)
    for time_constant_s in np.geomspace(0.1, max(duration_s / 3, 0.2), 5).tolist():
        for signal_name, squared_signal in ((axis.f, axis.f), (axis.x, axis.x), (axis.v, axis.v)):
            yield Term(
                f"{signal_name}*lag({squared_signal}**2, p0)", (time_constant_s,), ((shortest_s, 10 * longest_s),)
            )
    for share in (0.03, 0.1, 0.2, 0.4, 0.7):
        yield Term(f"play({axis.x}, p0)", (share * axis.travel,), ((1e-3 * axis.travel, axis.travel),))
    for delay_s in (2 * shortest_s, 5 * shortest_s, 0.01, 0.03):
        for signal_name in (axis.x, axis.f):
            yield Term(f"delay({signal_name}, p0)", (delay_s,), ((0.5 * shortest_s, 0.2),))
    yield Term(f"integral({axis.x})")


def _generate_cross_axis_terms(own_axis: Axis, other_axes: Sequence[Axis]) -> Iterator[Term]:
    """Terms of the motion or the command of other axes, alone or times a signal of the own axis; and drag by the speed
    in space."""
    x, v, f = own_axis.x, own_axis.v, own_axis.f
    for other_axis in other_axes:
        shapes = (
            other_axis.v, other_axis.x, other_axis.f, f"{x}*{other_axis.x}", f"{other_axis.x}**2",
            f"{v}*{other_axis.x}", f"{v}*abs({other_axis.x})", f"{v}*{other_axis.x}**2", f"{x}**2*{other_axis.x}",
            f"{x}*{other_axis.v}", f"{v}*{other_axis.v}", f"{other_axis.v}*abs({v})", f"{other_axis.v}**2",
            f"{other_axis.v}*abs({other_axis.v})", f"{v}*abs({other_axis.v})",
            f"{x}*{other_axis.x}**2", f"{other_axis.x}*{other_axis.v}", f"sign({other_axis.v})",
            f"{other_axis.f}*{x}", f"{f}*{other_axis.x}", f"{f}*{other_axis.f}", f"{other_axis.x}**3",
            f"{x}*{other_axis.v}**2", f"{other_axis.x}*{other_axis.v}**2",
        )  # fmt: skip
        yield from (Term(shape) for shape in shapes)
    for first_axis, second_axis in product(other_axes, other_axes):
        if first_axis.x < second_axis.x:
            yield from (
                Term(f"{a}*{b}") for a, b in product((first_axis.x, first_axis.v), (second_axis.x, second_axis.v))
            )
    if other_axes:
        squared_speeds = " + ".join(f"{axis.v}**2" for axis in (own_axis, *other_axes))
        yield Term(f"sqrt({squared_speeds})*{v}")


def _generate_drift_terms(axis: Axis, duration_s: float) -> Iterator[Term]:
    """Stiffness, damping, gain or force that changes linearly with time."""
    yield from (Term(f"{signal_name}*t") for signal_name in (axis.x, axis.v, axis.f))
    yield Term("t")


def find_periodic_terms(
    columns: Columns, own_axis: Axis, missing_force: FloatArray, rate_hz: float
) -> tuple[Term, ...]:
    """Sines of position with a free pitch, alone or times command or velocity, and sines of time with a free frequency,
    times position, velocity or command. They start at the strongest spectral lines of `missing_force` (n,); pitches of
    1/12 of the travel or more, which hardly make a line, also start on a grid. No pitch exceeds the travel."""
    x = columns[own_axis.x]
    stride = max(len(x) // 8000, 1)
    wave_numbers = np.arange(1.0, 40.0, 0.175) / own_axis.travel
    phasors = np.exp(-2j * np.pi * np.outer(x[::stride], wave_numbers)).astype(np.complex64)
    terms = []
    travel = float(np.ptp(x))
    for weight_signal, wave_count, phase in product(
        ("", own_axis.f, own_axis.v), np.geomspace(1.0, 12.0, 13).tolist(), (0.0, np.pi / 2)
    ):
        pitch = travel / wave_count
        terms.append(
            _build_sine_term(weight_signal, f"{own_axis.x}/p0", pitch, (0.5 * pitch, min(2 * pitch, travel)), phase)
        )
    for weight_signal in ("", own_axis.f, own_axis.v):
        weight = columns[weight_signal] if weight_signal else np.ones_like(x)
        lines = (missing_force * weight)[::stride].astype(np.complex64) @ phasors
        for line_index in _find_peaks(np.abs(lines), 2):
            pitch = 1 / float(wave_numbers[line_index])
            bounds = (0.5 * pitch, min(2 * pitch, travel))
            terms.append(
                _build_sine_term(
                    weight_signal, f"{own_axis.x}/p0", pitch, bounds, _compute_sine_phase(lines[line_index])
                )
            )
    for weight_signal in (own_axis.x, own_axis.v, own_axis.f):
        padded_length = 4 * len(x)  # Zero-padded: a start half a line off is out of phase by the end.
        lines = np.fft.rfft(missing_force * columns[weight_signal], padded_length)
        lines[: int(_SLOWEST_LINE_HZ * padded_length / rate_hz) + 1] = 0
        line_index = int(np.argmax(np.abs(lines)))
        line_hz = max(line_index, 1) * rate_hz / padded_length
        terms.append(
            _build_sine_term(
                weight_signal, "p0*t", line_hz, (0.8 * line_hz, 1.2 * line_hz), _compute_sine_phase(lines[line_index])
            )
        )
    return tuple(terms)


_SLOWEST_LINE_HZ = 0.1
"""Frequency (Hz) up to which lines in time are not searched: drifts are terms of their own."""


def _build_sine_term(
    weight: str, argument: str, start_value: float, bounds: tuple[float, float], start_phase: float
) -> Term:
    """A sine times a weight (empty: alone). argument: formula of the cycles, with p0 in it; start_value and bounds: of
    p0; start_phase: of p1, rad."""
    shape = f"sin(2*pi*{argument} + p1)"
    return Term(f"{weight}*{shape}" if weight else shape, (start_value, start_phase), (bounds, (-20.0, 20.0)), (), (1,))


def _compute_sine_phase(spectral_line: complex) -> float:
    """Phase (rad) of a sine from its complex Fourier coefficient, whose angle is that of a cosine."""
    return float(np.angle(spectral_line) + np.pi / 2)


def _find_peaks(power: FloatArray, max_count: int) -> list[int]:
    """Indices of the largest local maxima of a spectrum (lines,), over two neighbours on each side; largest first."""
    peaks = [k for k in range(2, len(power) - 2) if power[k] == power[k - 2 : k + 3].max()]
    return sorted(peaks, key=lambda k: -power[k])[:max_count]
