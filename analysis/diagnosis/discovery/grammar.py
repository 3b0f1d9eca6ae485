"""The grammar of discovered laws: terms of the motion and the commands, with free parameters.

A term is a shape times a factor; its free parameters (exponents, widths, time constants, pitches) start on a grid that
spans the recording's travel, speed and duration. Forces linear in an axis's own motion are not terms: mass, damping and
stiffness are parameters of the model. Nor is a constant force, which each regression contains (`screen_terms`).
docs/diagnosis.md lists what the grammar contains and what it does not. Grids and bounds, most of them relative to the
scales of the recording, are chosen by hand.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from equalizer.signals.signal import FloatArray

Columns = Mapping[str, FloatArray]
"""Signals along a recording by name, (n,) each, in SI units: positions x, y, z, velocities vx, …, accelerations dvx, …
and commands fx, … of the axes, readings ax, … of the response channels, time t."""
AXES = "xyz"
"""Letters of the first three axes in the names of signals; further axes are not searched."""
_SIGNAL_PATTERN = re.compile(rf"\b(?:(?:v|f|a|dv)?[{AXES}]|t)\b")
"""Pattern of a signal's name in a formula."""
CONSTANT = "1"
"""Shape of a constant force."""
POWER_BOUNDS = (0.15, 6.0)
"""Bounds of an exponent: near 0 a power is nearly a step, and a large one nearly an end stop."""
STATIC_EXCESS_BOUNDS = (0.02, 20.0)
"""Bounds of the excess of static over sliding friction, relative to the latter."""


@dataclass(frozen=True, slots=True)
class Term:
    """A term of a discovered law: a formula with free parameters, their starting values and bounds. Its factor is
    fitted separately."""

    shape: str
    """Formula in the language of laws; its free parameters are p0, p1, …"""
    numbers: tuple[float, ...] = ()
    """Values of the free parameters, in SI units: starting values in the grammar, fitted ones in a `Sum`."""
    bounds: tuple[tuple[float, float], ...] = ()
    """Bounds of each parameter."""
    exponents: tuple[int, ...] = ()
    """Indices of the parameters that are exponents."""
    angles: tuple[int, ...] = ()
    """Indices of the parameters that are angles; no other is negative."""
    family: str = ""
    """Shapes of one family differ by an integer exponent; where one ranks high, all are fitted. Empty: the shape
    itself."""

    @property
    def variables(self) -> frozenset[str]:
        """Signals in the formula, by the names of `Columns`."""
        return frozenset(_SIGNAL_PATTERN.findall(self.shape))


def format_odd_power(signal_name: str, parameter_index: int) -> str:
    """Write the formula of an odd power of a signal, abs(x)^p sign(x). parameter_index: index of the free exponent."""
    return f"abs({signal_name})**p{parameter_index}*sign({signal_name})"


def format_even_power(signal_name: str, parameter_index: int) -> str:
    """Write the formula of an even power of a signal, abs(x)^p. parameter_index: index of the free exponent."""
    return f"abs({signal_name})**p{parameter_index}"


@dataclass(frozen=True, slots=True)
class Axis:
    """Names of one axis's signals, and their largest magnitudes in a recording."""

    x: str
    """Name of the position in `Columns`."""
    v: str
    """Name of the velocity."""
    f: str
    """Name of the command."""
    largest_position: float
    """Largest magnitude of the position, in m (rad)."""
    largest_speed: float
    """Largest magnitude of the velocity, in m/s (rad/s)."""
    largest_command: float
    """Largest magnitude of the command, in N (N m)."""


def measure_axes(columns: Columns, axis_count: int) -> tuple[Axis, ...]:
    """Measure the largest magnitudes of the signals of the first `axis_count` axes, at most three."""

    def find_largest(signal_name: str) -> float:
        """Find the largest magnitude of a signal in its SI unit, at least 1e-12 so that scales are positive."""
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
        for letter in AXES[:axis_count]
    )


def list_terms(axes: Sequence[Axis], axis_index: int, duration_s: float, rate_hz: float) -> tuple[Term, ...]:
    """List all terms of a force along one axis, except the periodic ones (`periodic_terms`). axes: from `measure_axes`.
    axis_index: the force's axis. duration_s, rate_hz: duration (s) and sample rate (Hz) of the recording."""
    own_axis, other_axes = axes[axis_index], [axis for index, axis in enumerate(axes) if index != axis_index]
    terms = (
        *_generate_power_terms(own_axis), *_generate_product_terms(own_axis), *_generate_hinge_terms(own_axis),
        *_generate_saturation_terms(own_axis), *_generate_pole_terms(own_axis),
        *_generate_memory_terms(own_axis, duration_s, rate_hz),
        *_generate_cross_axis_terms(own_axis, other_axes), *_generate_drift_terms(own_axis),
        *_generate_inertia_terms(own_axis, other_axes),
    )  # fmt: skip
    return tuple(terms)


def _generate_power_terms(axis: Axis) -> Iterator[Term]:
    """Generate dry friction, and odd and even powers of velocity, position and command with a free exponent."""
    yield Term(f"sign({axis.v})")
    for signal_name, exponents in ((axis.v, (0.25, 0.5, 1.5, 2.0, 3.0, 5.0)), (axis.x, (0.5, 1.5, 2.0, 3.0, 5.0)),
                            (axis.f, (0.5, 1.5, 2.0, 3.0, 5.0))):  # fmt: skip
        for exponent in exponents:
            yield Term(format_odd_power(signal_name, 0), (exponent,), (POWER_BOUNDS,), (0,))
        for exponent in (1.0, 2.0, 4.0):
            yield Term(format_even_power(signal_name, 0), (exponent,), (POWER_BOUNDS,), (0,))


def _generate_product_terms(axis: Axis) -> Iterator[Term]:
    """Generate products of powers of position and velocity, of a power of position with dry friction, and of a power of
    position or velocity with the command or its magnitude."""
    for (format_x_power, format_v_power), x_exponent, v_exponent in product(
        product((format_odd_power, format_even_power), (format_odd_power, format_even_power)), (1.0, 2.0), (1.0, 2.0)
    ):
        yield Term(
            f"{format_x_power(axis.x, 0)}*{format_v_power(axis.v, 1)}",
            (x_exponent, v_exponent),
            (POWER_BOUNDS, POWER_BOUNDS),
            (0, 1),
        )
    for format_power, exponent in product((format_odd_power, format_even_power), (1.0, 2.0)):
        yield Term(f"{format_power(axis.x, 0)}*sign({axis.v})", (exponent,), (POWER_BOUNDS,), (0,))
        for force_factor, signal_name in product((axis.f, f"abs({axis.f})"), (axis.x, axis.v)):
            yield Term(f"{format_power(signal_name, 0)}*{force_factor}", (exponent,), (POWER_BOUNDS,), (0,))


def _generate_hinge_terms(axis: Axis) -> Iterator[Term]:
    """Generate forces that begin at an edge: springs and damping beyond a position, dead zones of position and of
    velocity."""
    for share in (0.2, 0.4, 0.6, 0.8):
        start_edge, edge_bounds = share * axis.largest_position, (0.0, axis.largest_position)
        for position in (axis.x, f"(-{axis.x})"):
            yield Term(f"maximum({position} - p0, 0)**p1", (start_edge, 1.0), (edge_bounds, POWER_BOUNDS), (1,))
            yield Term(f"maximum(sign({position} - p0), 0)*{axis.v}", (start_edge,), (edge_bounds,))
        yield Term(
            f"maximum(abs({axis.x}) - p0, 0)**p1*sign({axis.x})", (start_edge, 1.0), (edge_bounds, POWER_BOUNDS), (1,)
        )
        yield Term(
            f"maximum(abs({axis.v}) - p0, 0)*sign({axis.v})",
            (share * axis.largest_speed,),
            ((0.0, axis.largest_speed),),
        )


def _generate_saturation_terms(axis: Axis) -> Iterator[Term]:
    """Generate saturating and peaked functions of velocity or position with a free width, dry friction that falls with
    the speed, and limits of the command, soft or with an edge."""
    for (signal_name, largest), share in product(
        ((axis.v, axis.largest_speed), (axis.x, axis.largest_position)), (0.03, 0.1, 0.3, 1.0)
    ):
        start_and_bounds = (share * largest,), ((1e-3 * largest, 10 * largest),)
        yield Term(f"tanh({signal_name}/p0)", *start_and_bounds)
        yield Term(f"atan({signal_name}/p0)", *start_and_bounds)
        yield Term(f"{signal_name}/(1 + abs({signal_name})/p0)", *start_and_bounds)
        yield Term(f"{signal_name}/(1 + ({signal_name}/p0)**2)", *start_and_bounds)
        yield Term(f"{signal_name}*exp(-({signal_name}/p0)**2)", *start_and_bounds)
    for share in (0.01, 0.03, 0.1, 0.3):
        speed_bounds = (1e-3 * axis.largest_speed, 10 * axis.largest_speed)
        for decay_formula in ("exp(-abs({0})/{1})", "exp(-({0}/{1})**2)"):
            yield Term(
                f"sign({axis.v})*{decay_formula.format(axis.v, 'p0')}", (share * axis.largest_speed,), (speed_bounds,)
            )
            yield Term(
                f"sign({axis.v})*(1 + p0*{decay_formula.format(axis.v, 'p1')})",
                (0.5, share * axis.largest_speed),
                (STATIC_EXCESS_BOUNDS, speed_bounds),
            )
    yield from generate_soft_limit_terms(axis.f, axis.largest_command)
    for share in (0.3, 0.5, 0.7, 0.9):
        yield Term(
            f"maximum(abs({axis.f}) - p0, 0)*sign({axis.f})",
            (share * axis.largest_command,),
            ((0.0, axis.largest_command),),
        )


def generate_soft_limit_terms(signal_name: str, largest: float) -> Iterator[Term]:
    """Generate soft limits of a command or a reading, minus the signal itself, so that small signals are unchanged: no
    parameter of the model could compensate for a gain. largest: magnitude of the signal, in its unit."""
    for limit_text, share in product(
        ("tanh({0}/p0)*p0", "atan({0}/p0)*p0", "{0}/(1 + abs({0})/p0)"), (0.2, 0.5, 1.0, 2.0)
    ):
        yield Term(
            f"({limit_text.format(signal_name)} - {signal_name})", (share * largest,), ((1e-2 * largest, 20 * largest),)
        )


def _generate_pole_terms(axis: Axis) -> Iterator[Term]:
    """Generate inverse powers of the distance to a position that the axis did not reach, with or without their value at
    zero subtracted. Integer exponents are fitted separately, because a free exponent is strongly correlated with the
    position."""
    pole_bounds = (1.02 * axis.largest_position, 20 * axis.largest_position)
    for share, power, position in product((1.15, 1.5, 2.5), (1, 2, 3), (axis.x, f"(-{axis.x})")):
        integer_shape = f"(1/abs(p0 - {position})**{power} - 1/p0**{power})"
        yield Term(integer_shape, (share * axis.largest_position,), (pole_bounds,), family=f"pole of {position}")
        for shape in (f"(1/abs(p0 - {position})**p1 - 1/p0**p1)", f"1/abs(p0 - {position})**p1"):
            yield Term(shape, (share * axis.largest_position, float(power)), (pole_bounds, POWER_BOUNDS), (1,))


def _generate_memory_terms(axis: Axis, duration_s: float, rate_hz: float) -> Iterator[Term]:
    """Generate terms with memory: first-order lags, drift of gains with a lagged square (heating), play, delays and the
    integral of the position."""
    sample_period_s = 1 / rate_hz
    for time_constant_s in np.geomspace(
        2 * sample_period_s, max(min(8.0, duration_s / 4), 4 * sample_period_s), 8
    ).tolist():
        bounds = ((sample_period_s, duration_s),)
        for signal_name in (axis.x, axis.v, axis.f):
            yield Term(f"lag({signal_name}, p0)", (time_constant_s,), bounds)
    for time_constant_s in np.geomspace(0.1, max(duration_s / 3, 0.2), 5).tolist():
        for signal_name in (axis.f, axis.x, axis.v):
            yield Term(
                f"{signal_name}*lag({signal_name}**2, p0)", (time_constant_s,), ((sample_period_s, 10 * duration_s),)
            )
    for share in (0.03, 0.1, 0.2, 0.4, 0.7):
        yield Term(
            f"play({axis.x}, p0)",
            (share * axis.largest_position,),
            ((1e-3 * axis.largest_position, axis.largest_position),),
        )
    for delay_s in (2 * sample_period_s, 5 * sample_period_s, 0.01, 0.03):
        for signal_name in (axis.x, axis.f):
            yield Term(f"delay({signal_name}, p0)", (delay_s,), ((0.5 * sample_period_s, 0.2),))
    yield Term(f"integral({axis.x})")


def _generate_cross_axis_terms(own_axis: Axis, other_axes: Sequence[Axis]) -> Iterator[Term]:
    """Generate terms of the motion or the command of other axes, alone, times each other or times a signal of the own
    axis; and drag by the speed in space."""
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
                Term(f"{first_signal}*{second_signal}")
                for first_signal, second_signal in product((first_axis.x, first_axis.v), (second_axis.x, second_axis.v))
            )
    if other_axes:
        squared_speeds = " + ".join(f"{axis.v}**2" for axis in (own_axis, *other_axes))
        yield Term(f"sqrt({squared_speeds})*{v}")


def _generate_inertia_terms(own_axis: Axis, other_axes: Sequence[Axis]) -> Iterator[Term]:
    """Generate inertia that changes with the position q as m(q) = m0 + c q or m0 + c q², by Lagrange's equation m(q)
    dv/dt + m'(q) v²/2 = F; that of the own axis may depend on another axis's position, whose speed then enters, and
    that of another axis on the own position. Terms of the acceleration are also tried without that of the speed."""
    x, v = own_axis.x, own_axis.v
    for shape in (f"({x}*d{v} + {v}**2/2)", f"({x}**2*d{v} + {x}*{v}**2)", f"{x}*d{v}"):
        yield Term(shape)
    for other_axis in other_axes:
        x2, v2 = other_axis.x, other_axis.v
        for shape in (f"({x2}*d{v} + {v2}*{v})", f"({x2}**2*d{v} + 2*{x2}*{v2}*{v})", f"{x}*d{v2}", f"{x2}*d{v2}"):
            yield Term(shape)


def _generate_drift_terms(axis: Axis) -> Iterator[Term]:
    """Generate stiffness, damping, gain of the command and force that change linearly with time."""
    yield from (Term(f"{signal_name}*t") for signal_name in (axis.x, axis.v, axis.f))
    yield Term("t")
