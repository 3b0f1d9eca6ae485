"""Nonlinear springs, end stops, backlash, gravity torque, and linear dynamics of a higher order."""

from collections.abc import Iterator

import numpy as np

from analysis.diagnosis.balance.law import Columns, Law, Numbers, Scales, Values, filter_from_rest, name_weights
from analysis.diagnosis.balance.motion import Motion
from equalizer.effects.gravity_torque import LEAST_TRAVEL_RAD
from equalizer.signals.signal import FloatArray


def stiffness_laws(c: int, of: Scales) -> Iterator[Law]:
    """Gravity torque, nonlinear springs, end stops and backlash along channel c, with start values on grids of its
    travel. None but gravity torque for a shaft that turns more than twice."""
    if of.rotational and of.travel > LEAST_TRAVEL_RAD:
        yield Law(
            "gravity_torque", c, (), lambda m, _: np.hstack([np.sin(m.position[:, [c]]), np.cos(m.position[:, [c]])]),
            lambda w, n, mass: {"torque": float(np.hypot(*w)), "angle": float(np.arctan2(w[1], w[0]))},
        )  # fmt: skip
    if of.turns:
        return
    yield Law("hardening_stiffness", c, (), lambda m, _: m.position[:, [c]] ** 3, name_weights("k3"))
    yield Law("asymmetric_stiffness", c, (), lambda m, _: m.position[:, [c]] ** 2, name_weights("k2"))
    for share in (0.02, 0.05, 0.1, 0.2):
        for end, side in ((of.high - share * of.travel, 1.0), (of.low + share * of.travel, -1.0)):
            yield Law(
                "end_stop", c, (float(end),),
                _stop_columns(c, side), _stop_values(side), bounded=((of.low, of.high),),
            )  # fmt: skip
    for half in of.travel * np.geomspace(0.01, 0.3, 6):
        yield Law(
            "backlash", c, (float(half),), lambda m, n: -np.clip(m.position[:, [c]], -n[0], n[0]),
            lambda w, n, mass: {"gap": 2 * n[0], "contact_stiffness": float(w[0])} if w[0] > 0 else None,
            bounded=((1e-3 * of.travel, 0.45 * of.travel),),
        )  # fmt: skip


def _stop_values(side: float) -> Values:
    """Parameters of an end stop on one side; the result states it where the stop is not on that side of zero."""

    def values(w: FloatArray, n: Numbers, mass: float) -> dict[str, float] | None:
        beyond = {} if side * n[0] > 0 else {"side": side}
        return {"position": n[0], "stiffness": float(w[0]), "opposite": 0.0, **beyond} if w[0] > 0 else None

    return values


def _stop_columns(c: int, side: float) -> Columns:
    return lambda m, n: side * np.maximum(side * (m.position[:, [c]] - n[0]), 0.0)


def dynamic_laws(c: int, of: Scales) -> Iterator[Law]:
    """Pose-dependent inertia, an extra mode on a grid of frequencies and damping ratios, and amplifier lag along
    channel c."""
    if not of.turns:
        yield Law(
            "pose_dependent_inertia", c, (),
            lambda m, _: m.position[:, [c]] * m.acceleration[:, [c]] + 0.5 * m.velocity[:, [c]] ** 2,
            lambda w, n, mass: {"per_m": float(w[0] / mass), "speed_share": 0.5} if mass > 0 else None,
        )  # fmt: skip
    for ratio in (0.02, 0.1, 0.4):
        for f in of.band_hz * np.geomspace(0.02, 1.2, 12):
            yield Law(
                "extra_mode", c, (float(f), ratio), lambda m, n: _mode_force(m, c, n), _mode_values, linear=True,
                bounded=((0.005 * of.band_hz, 1.5 * of.band_hz), (0.002, 1.0)),
            )  # fmt: skip
    yield Law(
        "amplifier_lag", c, (), lambda m, _: filter_from_rest(m.acceleration[:, [c]], m.rate_hz, lambda s: s),
        lambda w, n, mass: {"time_constant": float(w[0] / mass)} if mass > 0 and w[0] > 0 else None, linear=True,
    )  # fmt: skip


def _mode_force(m: Motion, c: int, n: Numbers) -> FloatArray:
    """(n, 1): force per kg of a body that is attached to the axis by a spring and a damper."""
    turn, loss = 2 * np.pi * n[0], 2 * n[1] * 2 * np.pi * n[0]
    return filter_from_rest(
        m.acceleration[:, [c]], m.rate_hz, lambda s: (turn**2 + loss * s) / (s**2 + loss * s + turn**2)
    )


def _mode_values(w: FloatArray, n: Numbers, mass: float) -> dict[str, float] | None:
    return {"frequency": n[0], "mass": float(w[0]), "damping_ratio": n[1]} if w[0] > 0 else None
