"""Dry friction and damping along one measured motion, over grids of speeds, widths and time constants."""

from collections.abc import Iterator

import numpy as np

from analysis.diagnosis.balance.law import (
    Columns,
    Law,
    Numbers,
    Scales,
    filter_from_rest,
    name_positive_weight,
    name_weights,
    relative_time,
    smooth_sign,
)
from analysis.diagnosis.balance.motion import Motion
from equalizer.effects.simulation.along_motion import RESTS
from equalizer.effects.simulation.dry_friction_kernel import bristle_bend
from equalizer.signals.signal import FloatArray

SHARP = RESTS
"""Width of the smoothed sign of dry friction, relative to the rms speed, unless the data show a wider one."""


def friction_widths(of: Scales) -> tuple[FloatArray, tuple[tuple[float, float]]]:
    """Widths of the smoothed sign of dry friction, m/s, and the bounds of their refinement."""
    sharp = SHARP * of.speed
    return sharp * np.geomspace(1.0, 50.0, 7), ((0.1 * sharp, 0.5 * of.speed),)


def friction_laws(c: int, of: Scales) -> Iterator[Law]:
    """Coulomb, Stribeck, presliding, asymmetric, drifting and position-dependent friction along channel c, with start
    values on grids of its speed and travel."""
    sharp = SHARP * of.speed
    widths_of_sign, spans = friction_widths(of)
    for width in widths_of_sign:
        yield Law(
            "coulomb_friction", c, (float(width),), lambda m, n: smooth_sign(m.velocity[:, c : c + 1], n[0]),
            name_positive_weight("level"), bounded=spans,
        )  # fmt: skip
    for slow in of.speed * np.geomspace(0.03, 1.5, 7):
        yield Law("stribeck_friction", c, (float(slow),), _stribeck_columns(c, sharp), _stribeck_values, bounded=spans)
    widths = np.geomspace(0.003, 0.5, 7) if of.turns else of.travel * np.geomspace(0.001, 0.3, 9)
    for width in widths:
        yield Law(
            "presliding_hysteresis", c, (float(width),), lambda m, n: bristle_bend(m.position[:, c], n[0])[:, None],
            _presliding_values, bounded=((0.1 * widths[0], widths[-1]),),
        )  # fmt: skip
    yield Law("asymmetric_friction", c, (), _asymmetric_columns(c, sharp), _asymmetric_values)
    if np.isfinite(of.band_hz):
        yield Law("drifting_friction", c, (), _drifting_columns(c, sharp), _drifting_values)
    if not of.turns:
        yield Law(
            "position_dependent_friction", c, (), _position_dependent_columns(c, sharp), _position_dependent_values
        )


def _stribeck_columns(c: int, sharp: float) -> Columns:
    def columns(m: Motion, n: Numbers) -> FloatArray:
        v = m.velocity[:, c : c + 1]
        return np.hstack([smooth_sign(v, sharp), smooth_sign(v, sharp) * np.exp(-((v / n[0]) ** 2))])

    return columns


def _stribeck_values(w: FloatArray, n: Numbers, mass: float) -> dict[str, float] | None:
    if w[0] <= 0 or w[1] <= 0:
        return None
    return {"coulomb": float(w[0]), "static": float(w[0] + w[1]), "speed": n[0]}


def _presliding_values(w: FloatArray, n: Numbers, mass: float) -> dict[str, float] | None:
    return {"level": float(w[0]), "stiffness": float(w[0] / n[0])} if w[0] > 0 else None


def _asymmetric_columns(c: int, sharp: float) -> Columns:
    return lambda m, _: np.hstack(
        [
            np.maximum(smooth_sign(m.velocity[:, [c]], sharp), 0.0),
            np.minimum(smooth_sign(m.velocity[:, [c]], sharp), 0.0),
        ]
    )


def _asymmetric_values(w: FloatArray, n: Numbers, mass: float) -> dict[str, float] | None:
    return {"level_positive": float(w[0]), "level_negative": float(w[1])} if w.min() > 0 else None


def _drifting_columns(c: int, sharp: float) -> Columns:
    def columns(m: Motion, _: Numbers) -> FloatArray:
        rubbing = smooth_sign(m.velocity[:, [c]], sharp)
        return np.hstack([rubbing, rubbing * relative_time(m)])

    return columns


def _drifting_values(w: FloatArray, n: Numbers, mass: float) -> dict[str, float] | None:
    """Parameters of a drifting friction; None where it would be negative somewhere in the part: it would drive the
    motion."""
    return {"level": float(w[0]), "change": float(w[1])} if w[0] > abs(w[1]) else None


def _position_dependent_columns(c: int, sharp: float) -> Columns:
    def columns(m: Motion, _: Numbers) -> FloatArray:
        rubbing, q = smooth_sign(m.velocity[:, [c]], sharp), m.position[:, [c]]
        return np.hstack([rubbing, rubbing * q, rubbing * q**2])

    return columns


def _position_dependent_values(w: FloatArray, n: Numbers, mass: float) -> dict[str, float] | None:
    if w[0] <= 0:
        return None
    return {"level": float(w[0]), "slope_per_m": float(w[1] / w[0]), "bend_per_m2": float(w[2] / w[0])}


def damping_laws(c: int, of: Scales) -> Iterator[Law]:
    """Laws of the speed; none without a time axis, because the speed is then unknown."""
    if not np.isfinite(of.band_hz):
        return
    yield Law(
        "quadratic_damping", c, (), lambda m, _: m.velocity[:, [c]] * np.abs(m.velocity[:, [c]]),
        name_positive_weight("coefficient"),
    )  # fmt: skip
    yield Law("drifting_damping", c, (), lambda m, _: m.velocity[:, [c]] * relative_time(m), name_weights("change"))
    for tau in np.geomspace(0.5 / of.band_hz, of.seconds / 10, 7):
        yield Law(
            "viscoelastic_relaxation", c, (float(tau),),
            lambda m, n: filter_from_rest(m.velocity[:, [c]], m.rate_hz, lambda s: n[0] / (1 + n[0] * s)),
            lambda w, n, mass: {"stiffness": float(w[0]), "time_constant": n[0]} if w[0] > 0 else None,
            linear=True, bounded=((0.1 / of.band_hz, of.seconds / 4),),
        )  # fmt: skip
