"""Dry friction and damping along one measured motion, over grids of speeds, widths and time constants.

With position q, velocity v, sigma = tanh(v / width) in place of sgn v, time tau = -1 to 1 over the recorded part, and
weights w, the force that resists the motion is (sources: the file of the name in `equalizer/effects`, if any):

    coulomb_friction             w sigma
    stribeck_friction            w1 sigma + w2 sigma exp(-(v / v_s)^2)
    presliding_hysteresis        w z,  dz/dq = (1 - z sgn v) / z_max                    (Dahl)
    asymmetric_friction          w1 max(sigma, 0) + w2 min(sigma, 0)
    drifting_friction            (w1 + w2 tau) sigma
    position_dependent_friction  (w1 + w2 q + w3 q^2) sigma
    quadratic_damping            w v |v|
    drifting_damping             w tau v
    viscoelastic_relaxation      w T / (1 + T s) v                                      (Maxwell: spring and damper)

Letters as in `law`: n are nonlinear parameters of a law (width, v_s, z_max or T), w its weights. The grids and bounds
of n are chosen by hand. Called by `motion_laws`."""

from collections.abc import Iterator

import numpy as np

from analysis.diagnosis.balance.laws.law import (
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
"""Least tried width of tanh(v / width), relative to the rms speed: the speed below which an axis may count as resting
in a simulation. A refinement may make a fitted width smaller."""


def compute_friction_widths(scales: Scales) -> tuple[FloatArray, tuple[tuple[float, float]]]:
    """Compute the tried widths of the smoothed sign of dry friction, m/s (rad/s), and the bounds of their
    refinement."""
    least_width = LEAST_WIDTH_SHARE * scales.speed
    return least_width * np.geomspace(1.0, 50.0, 7), ((0.1 * least_width, 0.5 * scales.speed),)


def make_friction_laws(channel: int, scales: Scales) -> Iterator[Law]:
    """Make Coulomb, Stribeck, presliding, asymmetric, drifting and position-dependent friction along a channel, with
    start values on grids of its speed and travel. Without a time axis no drifting friction; for a shaft that turns no
    position-dependent friction, and the presliding lengths are in rad instead of relative to the travel."""
    least_width = LEAST_WIDTH_SHARE * scales.speed
    # Stribeck velocities above half the rms speed keep their grid values: the law can then hardly be distinguished from
    # Coulomb friction with quadratic damping, and refining it gains nothing.
    sign_widths, speed_bounds = compute_friction_widths(scales)
    for width in sign_widths:
        yield Law(
            "coulomb_friction", channel, (float(width),),
            lambda motion, n: smooth_sign(motion.velocity[:, channel : channel + 1], n[0]),
            name_positive_weight("level"), bounds=speed_bounds,
        )  # fmt: skip
    for stribeck_speed in scales.speed * np.geomspace(0.03, 1.5, 7):
        yield Law(
            "stribeck_friction", channel, (float(stribeck_speed),),
            _make_stribeck_columns(channel, least_width), _convert_stribeck, bounds=speed_bounds,
        )  # fmt: skip
    presliding_lengths = (
        np.geomspace(0.003, 0.5, 7) if scales.turns_freely else scales.travel * np.geomspace(0.001, 0.3, 9)
    )
    for length in presliding_lengths:
        yield Law(
            "presliding_hysteresis", channel, (float(length),),
            lambda motion, n: compute_bristle_deflection(motion.position[:, channel], n[0])[:, None],
            _convert_presliding, bounds=((0.1 * presliding_lengths[0], presliding_lengths[-1]),),
        )  # fmt: skip
    yield Law("asymmetric_friction", channel, (), _make_asymmetric_columns(channel, least_width), _convert_asymmetric)
    if np.isfinite(scales.band_hz):
        yield Law("drifting_friction", channel, (), _make_drifting_columns(channel, least_width), _convert_drifting)
    if not scales.turns_freely:
        yield Law(
            "position_dependent_friction",
            channel,
            (),
            _make_parabolic_columns(channel, least_width),
            _convert_parabolic,
        )


def _make_stribeck_columns(channel: int, width: float) -> Columns:
    """Make the columns (samples, 2): the smoothed sign sigma, and sigma exp(-(v / v_s)^2). width: of sigma, m/s
    (rad/s)."""

    def compute_columns(motion: Motion, n: NonlinearParameters) -> FloatArray:
        v = motion.velocity[:, channel : channel + 1]
        return np.hstack([smooth_sign(v, width), smooth_sign(v, width) * np.exp(-((v / n[0]) ** 2))])

    return compute_columns


def _convert_stribeck(w: FloatArray, n: NonlinearParameters, mass: float) -> dict[str, float] | None:
    """Convert weights to the levels at high and zero speed and the Stribeck velocity; None unless both weights are
    positive."""
    if w[0] <= 0 or w[1] <= 0:
        return None
    return {"coulomb": float(w[0]), "static": float(w[0] + w[1]), "speed": n[0]}


def _convert_presliding(w: FloatArray, n: NonlinearParameters, mass: float) -> dict[str, float] | None:
    """Convert the weight to level and presliding stiffness w / z_max; None where the level is not positive."""
    return {"level": float(w[0]), "stiffness": float(w[0] / n[0])} if w[0] > 0 else None


def _make_asymmetric_columns(channel: int, width: float) -> Columns:
    """Make the columns (samples, 2): the smoothed sign of positive, and of negative velocities. width: m/s (rad/s)."""
    return lambda motion, _: np.hstack(
        [
            np.maximum(smooth_sign(motion.velocity[:, [channel]], width), 0.0),
            np.minimum(smooth_sign(motion.velocity[:, [channel]], width), 0.0),
        ]
    )


def _convert_asymmetric(w: FloatArray, n: NonlinearParameters, mass: float) -> dict[str, float] | None:
    """Convert weights to one level per direction; None unless both levels are positive."""
    return {"level_positive": float(w[0]), "level_negative": float(w[1])} if w.min() > 0 else None


def _make_drifting_columns(channel: int, width: float) -> Columns:
    """Make the columns (samples, 2): the smoothed sign sigma, and sigma tau. width: of sigma, m/s (rad/s)."""

    def compute_columns(motion: Motion, _: NonlinearParameters) -> FloatArray:
        sign = smooth_sign(motion.velocity[:, [channel]], width)
        return np.hstack([sign, sign * compute_relative_time(motion)])

    return compute_columns


def _convert_drifting(w: FloatArray, n: NonlinearParameters, mass: float) -> dict[str, float] | None:
    """Convert weights to level and change; None where the friction would be negative somewhere in the part, and drive
    the motion."""
    return {"level": float(w[0]), "change": float(w[1])} if w[0] > abs(w[1]) else None


def _make_parabolic_columns(channel: int, width: float) -> Columns:
    """Make the columns (samples, 3): the smoothed sign times 1, q and q^2. width: of the sign, m/s (rad/s)."""

    def compute_columns(motion: Motion, _: NonlinearParameters) -> FloatArray:
        sign, q = smooth_sign(motion.velocity[:, [channel]], width), motion.position[:, [channel]]
        return np.hstack([sign, sign * q, sign * q**2])

    return compute_columns


def _convert_parabolic(w: FloatArray, n: NonlinearParameters, mass: float) -> dict[str, float] | None:
    """Convert weights to level, and slope and curvature relative to it; None where the friction would not be positive
    at q = 0. At other positions the effect limits a negative parabola to zero."""
    if w[0] <= 0:
        return None
    return {"level": float(w[0]), "slope_per_m": float(w[1] / w[0]), "bend_per_m2": float(w[2] / w[0])}


def make_damping_laws(channel: int, scales: Scales) -> Iterator[Law]:
    """Make quadratic, drifting and viscoelastic damping along a channel; none without a time axis, because the speed is
    then unknown."""
    if not np.isfinite(scales.band_hz):
        return
    yield Law(
        "quadratic_damping", channel, (),
        lambda motion, _: motion.velocity[:, [channel]] * np.abs(motion.velocity[:, [channel]]),
        name_positive_weight("coefficient"),
    )  # fmt: skip
    yield Law(
        "drifting_damping",
        channel,
        (),
        lambda motion, _: motion.velocity[:, [channel]] * compute_relative_time(motion),
        name_weights("change"),
    )
    for time_constant_s in np.geomspace(0.5 / scales.band_hz, scales.duration_s / 10, 7):
        yield Law(
            "viscoelastic_relaxation", channel, (float(time_constant_s),),
            lambda motion, n: filter_from_rest(
                motion.velocity[:, [channel]], motion.rate_hz, lambda s: n[0] / (1 + n[0] * s)
            ),
            lambda w, n, mass: {"stiffness": float(w[0]), "time_constant": n[0]} if w[0] > 0 else None,
            is_linear=True, bounds=((0.1 / scales.band_hz, scales.duration_s / 4),),
        )  # fmt: skip
