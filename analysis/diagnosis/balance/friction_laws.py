"""Dry friction and damping along one measured motion, over grids of speeds, widths and time constants.

With position q (x), velocity v, sigma = tanh(v / width) in place of sgn v, time tau = -1 to 1 over the part, and
weights w, the force that resists the motion is (sources: the file of each name in `equalizer/effects`; called by
`laws`):

    coulomb_friction             w sigma
    stribeck_friction            w1 sigma + w2 sigma exp(-(v / v_s)^2)
    presliding_hysteresis        w z,  dz/dx = (1 - z sgn v) / z_max                    (Dahl)
    asymmetric_friction          w1 max(sigma, 0) + w2 min(sigma, 0)
    drifting_friction            (w1 + w2 tau) sigma
    position_dependent_friction  (w1 + w2 q + w3 q^2) sigma
    quadratic_damping            w v |v|
    drifting_damping             w tau v
    viscoelastic_relaxation      w T / (1 + T s) v                                      (Maxwell: spring and damper)
"""

from collections.abc import Iterator

import numpy as np

from analysis.diagnosis.balance.law import (
    Columns,
    Law,
    NonlinearParameters,
    Scales,
    compute_relative_time,
    filter_from_rest,
    name_positive_weight,
    name_weights,
    smooth_sign,
)
from analysis.diagnosis.balance.motion import Motion
from equalizer.effects.simulation.dry_friction_kernel import compute_bristle_deflection
from equalizer.effects.simulation.forces_along_motion import REST_SPEED_SHARE
from equalizer.signals.signal import FloatArray

LEAST_WIDTH_SHARE = REST_SPEED_SHARE
"""Least width of tanh(v / width), relative to the rms speed: the speed below which an axis may count as resting in a
simulation. Larger widths are tried where the width is fitted."""


def compute_friction_widths(scales: Scales) -> tuple[FloatArray, tuple[tuple[float, float]]]:
    """Compute the tried widths of the smoothed sign of dry friction, m/s (rad/s), and the bounds of their
    refinement."""
    least_width = LEAST_WIDTH_SHARE * scales.speed
    return least_width * np.geomspace(1.0, 50.0, 7), ((0.1 * least_width, 0.5 * scales.speed),)


def make_friction_laws(c: int, scales: Scales) -> Iterator[Law]:
    """Make Coulomb, Stribeck, presliding, asymmetric, drifting and position-dependent friction along channel c, with
    start values on grids of its speed and travel."""
    least_width = LEAST_WIDTH_SHARE * scales.speed
    # Stribeck velocities above half the rms speed keep their grid values: the law can then hardly be distinguished from
    # Coulomb friction with quadratic damping, and refining it gains nothing.
    sign_widths, speed_bounds = compute_friction_widths(scales)
    for width in sign_widths:
        yield Law(
            "coulomb_friction", c, (float(width),), lambda m, n: smooth_sign(m.velocity[:, c : c + 1], n[0]),
            name_positive_weight("level"), bounds=speed_bounds,
        )  # fmt: skip
    for stribeck_speed in scales.speed * np.geomspace(0.03, 1.5, 7):
        yield Law(
            "stribeck_friction",
            c,
            (float(stribeck_speed),),
            _make_stribeck_columns(c, least_width),
            _read_stribeck_values,
            bounds=speed_bounds,
        )
    presliding_lengths = np.geomspace(0.003, 0.5, 7) if scales.turns else scales.travel * np.geomspace(0.001, 0.3, 9)
    for width in presliding_lengths:
        yield Law(
            "presliding_hysteresis", c, (float(width),),
            lambda m, n: compute_bristle_deflection(m.position[:, c], n[0])[:, None],
            _read_presliding_values, bounds=((0.1 * presliding_lengths[0], presliding_lengths[-1]),),
        )  # fmt: skip
    yield Law("asymmetric_friction", c, (), _make_asymmetric_columns(c, least_width), _read_asymmetric_values)
    if np.isfinite(scales.band_hz):
        yield Law("drifting_friction", c, (), _make_drifting_columns(c, least_width), _read_drifting_values)
    if not scales.turns:
        yield Law("position_dependent_friction", c, (), _make_parabolic_columns(c, least_width), _read_parabolic_values)


def _make_stribeck_columns(c: int, width: float) -> Columns:
    """Columns (n, 2): the smoothed sign sigma, and sigma exp(-(v / v_s)^2). width: of the sign, m/s (rad/s)."""

    def compute_columns(m: Motion, n: NonlinearParameters) -> FloatArray:
        v = m.velocity[:, c : c + 1]
        return np.hstack([smooth_sign(v, width), smooth_sign(v, width) * np.exp(-((v / n[0]) ** 2))])

    return compute_columns


def _read_stribeck_values(w: FloatArray, n: NonlinearParameters, mass: float) -> dict[str, float] | None:
    """Convert weights to the levels at high and zero speed and the Stribeck velocity; None unless both are positive."""
    if w[0] <= 0 or w[1] <= 0:
        return None
    return {"coulomb": float(w[0]), "static": float(w[0] + w[1]), "speed": n[0]}


def _read_presliding_values(w: FloatArray, n: NonlinearParameters, mass: float) -> dict[str, float] | None:
    """Convert the weight to level and presliding stiffness; None where the level is not positive."""
    return {"level": float(w[0]), "stiffness": float(w[0] / n[0])} if w[0] > 0 else None


def _make_asymmetric_columns(c: int, width: float) -> Columns:
    """Columns (n, 2): the smoothed sign of positive, and of negative velocities."""
    return lambda m, _: np.hstack(
        [
            np.maximum(smooth_sign(m.velocity[:, [c]], width), 0.0),
            np.minimum(smooth_sign(m.velocity[:, [c]], width), 0.0),
        ]
    )


def _read_asymmetric_values(w: FloatArray, n: NonlinearParameters, mass: float) -> dict[str, float] | None:
    """Convert weights to one level per direction; None unless both are positive."""
    return {"level_positive": float(w[0]), "level_negative": float(w[1])} if w.min() > 0 else None


def _make_drifting_columns(c: int, width: float) -> Columns:
    """Columns (n, 2): the smoothed sign, and the same times the time from -1 to 1."""

    def compute_columns(m: Motion, _: NonlinearParameters) -> FloatArray:
        sign = smooth_sign(m.velocity[:, [c]], width)
        return np.hstack([sign, sign * compute_relative_time(m)])

    return compute_columns


def _read_drifting_values(w: FloatArray, n: NonlinearParameters, mass: float) -> dict[str, float] | None:
    """Convert weights to level and change; None where the friction would be negative somewhere in the part, and drive
    the motion."""
    return {"level": float(w[0]), "change": float(w[1])} if w[0] > abs(w[1]) else None


def _make_parabolic_columns(c: int, width: float) -> Columns:
    """Columns (n, 3): the smoothed sign times 1, q and q^2."""

    def compute_columns(m: Motion, _: NonlinearParameters) -> FloatArray:
        sign, q = smooth_sign(m.velocity[:, [c]], width), m.position[:, [c]]
        return np.hstack([sign, sign * q, sign * q**2])

    return compute_columns


def _read_parabolic_values(w: FloatArray, n: NonlinearParameters, mass: float) -> dict[str, float] | None:
    """Convert weights to level, slope and curvature; None where the friction would be negative at q = 0. At other
    positions the effect limits a negative parabola to zero."""
    if w[0] <= 0:
        return None
    return {"level": float(w[0]), "slope_per_m": float(w[1] / w[0]), "bend_per_m2": float(w[2] / w[0])}


def make_damping_laws(c: int, scales: Scales) -> Iterator[Law]:
    """Make quadratic, drifting and viscoelastic damping along channel c; none without a time axis, because the speed is
    then unknown."""
    if not np.isfinite(scales.band_hz):
        return
    yield Law(
        "quadratic_damping", c, (), lambda m, _: m.velocity[:, [c]] * np.abs(m.velocity[:, [c]]),
        name_positive_weight("coefficient"),
    )  # fmt: skip
    yield Law(
        "drifting_damping", c, (), lambda m, _: m.velocity[:, [c]] * compute_relative_time(m), name_weights("change")
    )
    for tau in np.geomspace(0.5 / scales.band_hz, scales.duration_s / 10, 7):
        yield Law(
            "viscoelastic_relaxation", c, (float(tau),),
            lambda m, n: filter_from_rest(m.velocity[:, [c]], m.rate_hz, lambda s: n[0] / (1 + n[0] * s)),
            lambda w, n, mass: {"stiffness": float(w[0]), "time_constant": n[0]} if w[0] > 0 else None,
            linear=True, bounds=((0.1 / scales.band_hz, scales.duration_s / 4),),
        )  # fmt: skip
