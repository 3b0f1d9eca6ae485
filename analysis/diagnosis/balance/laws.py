"""Candidate terms of the force balance of a moving axis, each on a grid of its nonlinear parameters.

Defined here: nonlinear springs, end stops, backlash, gravity torque, cogging, pose-dependent inertia, an extra mode and
amplifier lag. Friction and damping are in `friction_laws`; `law` states the balance.

The force of a law is phi(q, v, a; n)' w: linear in the weights w, with columns phi from the measured motion for given
nonlinear parameters n. The grids of n span the travel and the band of the recording, so that the search needs no
starting values. Columns are in SI units and have the sign of a force that resists the motion, as the balance's terms of
mass, damping and stiffness do.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from analysis.diagnosis.balance.friction_laws import damping_laws, friction_laws
from analysis.diagnosis.balance.law import (
    Columns,
    Law,
    Numbers,
    Scales,
    Values,
    filter_from_rest,
    name_weights,
    relative_time,
    scales_of,
)
from analysis.diagnosis.balance.motion import Motion
from equalizer.effects.gravity_torque import LEAST_TRAVEL_RAD
from equalizer.signals.signal import FloatArray

# Settings of the search for the pitch of a force that is periodic in the position, all chosen by hand.
LINE_SPACING = 0.35
"""Spacing of the spectral lines, relative to 1 / travel: the spectral peak of a force that is periodic over the whole
travel is about 1 / travel wide."""
MOST_LINES = 600
"""Number of lines that are searched, from the longest pitch down: pitches below 1 / 211 of the travel, or below 1 / 601
of a turn for a shaft that turns, are not found."""
MOST_SAMPLES = 6000
"""Largest number of samples, evenly spaced, from which the lines are computed."""
MOST_PITCHES = 4
"""Number of the strongest lines that are kept."""
STOP_AT = (0.02, 0.05, 0.1, 0.2)
"""Tried positions of an end stop: distances from either end of the travel, relative to the travel."""
HALF_GAPS = tuple(np.geomspace(0.01, 0.3, 6).tolist())
"""Tried half gaps of a backlash, relative to the travel."""
MODE_RATIOS, MODE_HZ = (0.02, 0.1, 0.4), tuple(np.geomspace(0.02, 1.2, 12).tolist())
"""Tried damping ratios of an extra mode, and tried frequencies relative to the upper end of the band."""


def laws_of(motions: Sequence[Motion], rotational: bool) -> Iterator[Law]:
    """All laws of all channels except `cogging_law`, whose pitch is found from the residual of the others. Laws that
    need a time axis are left out where the band is infinite."""
    for channel in range(len(motions[0].channels)):
        scales = scales_of(motions, channel, rotational)
        yield from friction_laws(channel, scales)
        yield from damping_laws(channel, scales)
        yield from stiffness_laws(channel, scales)
        if np.isfinite(scales.band_hz):
            yield from dynamic_laws(channel, scales)
        if motions[0].conditions:
            # Imported here: few recordings have conditions.
            from analysis.diagnosis.balance.condition_laws import condition_laws

            yield from condition_laws(motions, channel, scales)
    if np.isfinite(motions[0].band_hz) and motions[0].order < 2:
        yield Law("drifting_force", -1, (), lambda m, _: relative_time(m), name_weights("change"))


def _longest_pitch(scales: Scales) -> float:
    """Longest pitch (m or rad) of cogging: half the travel; of a rotational axis at most half a turn, because the force
    of an unbalanced or eccentric shaft has a period of one turn."""
    return min(0.5 * scales.travel, np.pi) if scales.rotational else 0.5 * scales.travel


def cogging_law(channel: int, pitch: float, scales: Scales) -> Law:
    """Cogging: a force that is periodic in the position, a sine and a cosine column. pitch: its period (m or rad)."""
    longest = _longest_pitch(scales)
    return Law(
        "cogging", channel, (pitch,),
        lambda m, n: np.hstack(
            [np.sin(2 * np.pi * m.position[:, [channel]] / n[0]), np.cos(2 * np.pi * m.position[:, [channel]] / n[0])]
        ),
        # Both weights change sign: the catalogue's force drives the motion, that of the balance resists it.
        lambda w, n, mass: {
            "amplitude": float(np.hypot(*w)), "pitch": n[0], "phase": float(np.arctan2(-w[1], -w[0])),
        } if n[0] <= longest else None,
        bounded=((0.9 * pitch, min(1.1 * pitch, longest)),),
    )  # fmt: skip


def likely_pitches(
    motions: Sequence[Motion], remainders: Sequence[FloatArray], channel: int, scales: Scales
) -> list[float]:
    """Pitches (m or rad) of the strongest lines in the spectrum of the residual force over the position, the strongest
    first. remainders: per motion, residual force (kept samples,). For a shaft that turns, only whole numbers of periods
    per turn are searched."""
    q = np.concatenate(
        [motion.position[:: motion.step, channel][motion.valid_samples(motion.fit)] for motion in motions]
    )
    residual = np.concatenate(
        [r[motion.valid_samples(motion.fit)] for motion, r in zip(motions, remainders, strict=True)]
    )
    longest = _longest_pitch(scales)
    # At the rms speed, shorter pitches give frequencies above the end of the band.
    shortest = scales.speed / scales.band_hz
    if shortest >= longest or not len(residual):
        return []
    spacing = 1 / (2 * np.pi) if scales.turns else LINE_SPACING / scales.travel
    lines = 1 / longest + spacing * np.arange(MOST_LINES)
    lines = lines[lines * shortest < 1]
    stride = max(len(q) // MOST_SAMPLES, 1)
    power = np.array([abs(np.mean(residual[::stride] * np.exp(-2j * np.pi * line * q[::stride]))) for line in lines])
    peaks = [k for k in range(len(power)) if power[k] == power[max(k - 2, 0) : k + 3].max()]
    return [float(1 / lines[k]) for k in sorted(peaks, key=lambda k: -power[k])[:MOST_PITCHES]]


def stiffness_laws(c: int, scales: Scales) -> Iterator[Law]:
    """Gravity torque, nonlinear springs, end stops and backlash along channel c, with starting values on grids over its
    travel. For a shaft that makes more than two turns: gravity torque only."""
    if scales.rotational and scales.travel > LEAST_TRAVEL_RAD:
        yield Law(
            "gravity_torque", c, (), lambda m, _: np.hstack([np.sin(m.position[:, [c]]), np.cos(m.position[:, [c]])]),
            lambda w, n, mass: {"torque": float(np.hypot(*w)), "angle": float(np.arctan2(w[1], w[0]))},
        )  # fmt: skip
    if scales.turns:
        return
    yield Law("hardening_stiffness", c, (), lambda m, _: m.position[:, [c]] ** 3, name_weights("k3"))
    yield Law("asymmetric_stiffness", c, (), lambda m, _: m.position[:, [c]] ** 2, name_weights("k2"))
    for share in STOP_AT:
        for end, side in ((scales.high - share * scales.travel, 1.0), (scales.low + share * scales.travel, -1.0)):
            yield Law(
                "end_stop", c, (float(end),),
                _stop_columns(c, side), _stop_values(side), bounded=((scales.low, scales.high),),
            )  # fmt: skip
    for half in scales.travel * np.array(HALF_GAPS):
        # Added to the balance's own spring term k x, it gives k (x - clip(x)): a spring that acts beyond the gap only.
        yield Law(
            "backlash", c, (float(half),), lambda m, n: -np.clip(m.position[:, [c]], -n[0], n[0]),
            lambda w, n, mass: {"gap": 2 * n[0], "contact_stiffness": float(w[0])} if w[0] > 0 else None,
            bounded=((1e-3 * scales.travel, 0.45 * scales.travel),),
        )  # fmt: skip


def _stop_values(side: float) -> Values:
    """Parameters of an end stop that blocks motion towards `side` (+1 or -1). They include `side` only where the sign
    of the position does not imply it. None for a stiffness that is not positive."""

    def values(w: FloatArray, n: Numbers, mass: float) -> dict[str, float] | None:
        side_parameter = {} if side * n[0] > 0 else {"side": side}
        return {"position": n[0], "stiffness": float(w[0]), "opposite": 0.0, **side_parameter} if w[0] > 0 else None

    return values


def _stop_columns(c: int, side: float) -> Columns:
    """Column (n, 1): penetration of the stop (m or rad), with the sign of `side`; zero before contact."""
    return lambda m, n: side * np.maximum(side * (m.position[:, [c]] - n[0]), 0.0)


def dynamic_laws(c: int, scales: Scales) -> Iterator[Law]:
    """Pose-dependent inertia, an extra mode on a grid of frequencies and damping ratios, and amplifier lag along
    channel c."""
    if not scales.turns:
        # Lagrange's equation of a mass M (1 + c x) adds M c (x a + v² / 2) to M a; the weight is M c.
        yield Law(
            "pose_dependent_inertia", c, (),
            lambda m, _: m.position[:, [c]] * m.acceleration[:, [c]] + 0.5 * m.velocity[:, [c]] ** 2,
            lambda w, n, mass: {"per_m": float(w[0] / mass), "speed_share": 0.5} if mass > 0 else None,
        )  # fmt: skip
    for ratio in MODE_RATIOS:
        for f in scales.band_hz * np.array(MODE_HZ):
            yield Law(
                "extra_mode", c, (float(f), ratio), lambda m, n: _mode_force(m, c, n), _mode_values, linear=True,
                bounded=((0.005 * scales.band_hz, 1.5 * scales.band_hz), (0.002, 1.0)),
            )  # fmt: skip
    # With a first-order lag, the command is (1 + T s) times the delivered force. Only T s M a is no base term.
    yield Law(
        "amplifier_lag", c, (), lambda m, _: filter_from_rest(m.acceleration[:, [c]], m.rate_hz, lambda s: s),
        lambda w, n, mass: {"time_constant": float(w[0] / mass)} if mass > 0 and w[0] > 0 else None, linear=True,
    )  # fmt: skip


def _mode_force(m: Motion, c: int, n: Numbers) -> FloatArray:
    """(n, 1): force per kg of a body on a spring and damper at the axis: the axis acceleration times
    (omega² + 2 zeta omega s) / (s² + 2 zeta omega s + omega²). n: frequency (Hz) and damping ratio zeta."""
    turn, loss = 2 * np.pi * n[0], 2 * n[1] * 2 * np.pi * n[0]
    return filter_from_rest(
        m.acceleration[:, [c]], m.rate_hz, lambda s: (turn**2 + loss * s) / (s**2 + loss * s + turn**2)
    )


def _mode_values(w: FloatArray, n: Numbers, mass: float) -> dict[str, float] | None:
    """Frequency (Hz), mass (kg or kg m²) and damping ratio of the mode; None for a mass that is not positive."""
    return {"frequency": n[0], "mass": float(w[0]), "damping_ratio": n[1]} if w[0] > 0 else None
