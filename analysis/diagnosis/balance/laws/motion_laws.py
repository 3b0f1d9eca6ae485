"""Candidate terms of the force balance of a moving axis, each on a grid of its nonlinear parameters.

Defined here: nonlinear springs, end stops, backlash, gravity torque, cogging, pose-dependent inertia, an extra mode,
amplifier lag and a drifting force. Friction and damping are in `friction_laws`; `law` states the balance.

The force of a law is phi(q, v, a; n)' w: linear in the weights w, with columns phi from the measured motion for given
nonlinear parameters n. The grids of n span the travel and the band of the recording, so that the search needs no
starting values; grids and bounds are chosen by hand. Columns are in SI units and have the sign of a force that resists
the motion, as the balance's terms of mass, damping and stiffness do. Letters in the code: weights w and nonlinear
parameters n, as here; s = i omega is Laplace's variable. Begin at `make_laws`."""

from collections.abc import Iterator, Sequence

import numpy as np

from analysis.diagnosis.balance.laws.friction_laws import make_damping_laws, make_friction_laws
from analysis.diagnosis.balance.laws.law import (
    Law,
    NonlinearParameters,
    Scales,
    WeightConverter,
    compute_relative_time,
    filter_from_rest,
    make_contact_columns,
    measure_scales,
    name_weights,
)
from analysis.diagnosis.balance.motion import Motion
from equalizer.effects.gravity_torque import LEAST_TRAVEL_RAD
from equalizer.signals.signal import FloatArray

# Settings of the search for the pitch of a force that is periodic in the position. A wavenumber is a spatial frequency,
# 1 / pitch.
WAVENUMBER_SPACING = 0.35
"""Spacing of the wavenumbers, relative to 1 / travel: the spectral peak of a force that is periodic over the whole
travel is about 1 / travel wide."""
MOST_WAVENUMBERS = 600
"""Number of wavenumbers that are searched, from the longest pitch down: pitches below about 1 / 211 of the travel, or 1
/ 601 of a turn for a shaft that turns, are not found."""
MOST_SPECTRUM_SAMPLES = 6000
"""The spectrum over the position is computed from evenly spaced samples, fewer than twice this number."""
MOST_PITCHES = 4
"""Largest number of pitches that are kept: those of the strongest spectral lines."""
STOP_DISTANCES = (0.02, 0.05, 0.1, 0.2)
"""Tried positions of an end stop: distances from either end of the travel, relative to the travel."""
HALF_GAPS = tuple(np.geomspace(0.01, 0.3, 6).tolist())
"""Tried half gaps of a backlash, relative to the travel."""
MODE_DAMPING_RATIOS, MODE_FREQUENCIES = (0.02, 0.1, 0.4), tuple(np.geomspace(0.02, 1.2, 12).tolist())
"""Tried damping ratios of an extra mode, and tried frequencies relative to the upper end of the band."""


def make_laws(motions: Sequence[Motion], rotational: bool) -> Iterator[Law]:
    """Make all laws of this file and `friction_laws`, and those of recorded conditions, for all channels; without
    `make_cogging_law`, whose pitch is found from the residual of the others. Laws that need a time axis are left out
    where the band is infinite; the drifting force also where an acceleration was measured."""
    for channel in range(len(motions[0].channels)):
        scales = measure_scales(motions, channel, rotational)
        yield from make_friction_laws(channel, scales)
        yield from make_damping_laws(channel, scales)
        yield from make_stiffness_laws(channel, scales)
        if np.isfinite(scales.band_hz):
            yield from make_dynamic_laws(channel, scales)
        if motions[0].conditions:
            # Imported here: few recordings have conditions.
            from analysis.diagnosis.balance.laws.condition_laws import make_condition_laws

            yield from make_condition_laws(motions, channel, scales)
    if np.isfinite(motions[0].band_hz) and motions[0].order < 2:
        yield Law("drifting_force", -1, (), lambda motion, _: compute_relative_time(motion), name_weights("change"))


def _compute_longest_pitch(scales: Scales) -> float:
    """Compute the longest pitch (m or rad) of cogging: half the travel; of a rotational axis at most half a turn,
    because the force of an unbalanced or eccentric shaft has a period of one turn."""
    return min(0.5 * scales.travel, np.pi) if scales.rotational else 0.5 * scales.travel


def make_cogging_law(channel: int, pitch: float, scales: Scales) -> Law:
    """Make the law of cogging, a force periodic in the position: a sine and a cosine column. pitch: period (m or
    rad)."""
    longest_pitch = _compute_longest_pitch(scales)
    return Law(
        "cogging", channel, (pitch,),
        lambda motion, n: np.hstack(
            [
                np.sin(2 * np.pi * motion.position[:, [channel]] / n[0]),
                np.cos(2 * np.pi * motion.position[:, [channel]] / n[0]),
            ]
        ),
        # Both weights change sign: the catalogue's force drives the motion, that of the balance resists it.
        lambda w, n, mass: {
            "amplitude": float(np.hypot(*w)), "pitch": n[0], "phase": float(np.arctan2(-w[1], -w[0])),
        } if n[0] <= longest_pitch else None,
        bounds=((0.9 * pitch, min(1.1 * pitch, longest_pitch)),),
    )  # fmt: skip


def find_likely_pitches(
    motions: Sequence[Motion], residuals: Sequence[FloatArray], channel: int, scales: Scales
) -> list[float]:
    """Find the pitches (m or rad) of the strongest lines in the spectrum of the residual force over the position, the
    strongest first; at most `MOST_PITCHES`. residuals: per motion, residual force (kept samples,) in N (N m). Empty
    without samples, or where the speed is too high for the band. For a shaft that turns, only whole numbers of periods
    per turn are searched."""
    q = np.concatenate(
        [motion.position[:: motion.step, channel][motion.mask_valid_samples(motion.fit)] for motion in motions]
    )
    residual = np.concatenate(
        [
            motion_residual[motion.mask_valid_samples(motion.fit)]
            for motion, motion_residual in zip(motions, residuals, strict=True)
        ]
    )
    longest_pitch = _compute_longest_pitch(scales)
    # At the rms speed, shorter pitches give frequencies above the end of the band.
    shortest_pitch = scales.speed / scales.band_hz
    if shortest_pitch >= longest_pitch or not len(residual):
        return []
    wavenumber_spacing = 1 / (2 * np.pi) if scales.turns_freely else WAVENUMBER_SPACING / scales.travel
    wavenumbers = 1 / longest_pitch + wavenumber_spacing * np.arange(MOST_WAVENUMBERS)
    wavenumbers = wavenumbers[wavenumbers * shortest_pitch < 1]
    stride = max(len(q) // MOST_SPECTRUM_SAMPLES, 1)
    line_amplitudes = np.array(
        [
            abs(np.mean(residual[::stride] * np.exp(-2j * np.pi * wavenumber * q[::stride])))
            for wavenumber in wavenumbers
        ]
    )
    peak_indices = [
        k for k in range(len(line_amplitudes)) if line_amplitudes[k] == line_amplitudes[max(k - 2, 0) : k + 3].max()
    ]
    return [float(1 / wavenumbers[k]) for k in sorted(peak_indices, key=lambda k: -line_amplitudes[k])[:MOST_PITCHES]]


def make_stiffness_laws(channel: int, scales: Scales) -> Iterator[Law]:
    """Make gravity torque, nonlinear springs, end stops and backlash along a channel, with starting values on grids
    over its travel. Gravity torque only where a shaft's travel exceeds `LEAST_TRAVEL_RAD`; for a shaft that makes more
    than two turns no other law."""
    if scales.rotational and scales.travel > LEAST_TRAVEL_RAD:
        yield Law(
            "gravity_torque", channel, (),
            lambda motion, _: np.hstack([np.sin(motion.position[:, [channel]]), np.cos(motion.position[:, [channel]])]),
            lambda w, n, mass: {"torque": float(np.hypot(*w)), "angle": float(np.arctan2(w[1], w[0]))},
        )  # fmt: skip
    if scales.turns_freely:
        return
    yield Law(
        "hardening_stiffness", channel, (), lambda motion, _: motion.position[:, [channel]] ** 3, name_weights("k3")
    )
    yield Law(
        "asymmetric_stiffness", channel, (), lambda motion, _: motion.position[:, [channel]] ** 2, name_weights("k2")
    )
    for depth in (share * scales.travel for share in STOP_DISTANCES):
        for end, side in ((scales.high, 1.0), (scales.low, -1.0)):
            yield Law(
                "end_stop", channel, (depth,), make_contact_columns(channel, end, side),
                _make_stop_converter(end, side), bounds=((1e-3 * scales.travel, scales.travel),),
            )  # fmt: skip
    for half_gap in scales.travel * np.array(HALF_GAPS):
        # With an equal weight of the balance's spring term k x, it gives k (x - clip(x)): a spring beyond the gap only.
        yield Law(
            "backlash", channel, (float(half_gap),),
            lambda motion, n: -np.clip(motion.position[:, [channel]], -n[0], n[0]),
            lambda w, n, mass: {"gap": 2 * n[0], "contact_stiffness": float(w[0])} if w[0] > 0 else None,
            bounds=((1e-3 * scales.travel, 0.45 * scales.travel),),
        )  # fmt: skip


def _make_stop_converter(end: float, side: float) -> WeightConverter:
    """Make the function that converts the weight and the depth of the stop at an end of the travel to the parameters of
    an end stop towards `side` (+1 or -1). They include `side` only where the sign of the position does not imply it.
    None for a stiffness that is not positive."""

    def convert_weight(w: FloatArray, n: NonlinearParameters, mass: float) -> dict[str, float] | None:
        position = end - side * n[0]
        side_parameter = {} if side * position > 0 else {"side": side}
        return {"position": position, "stiffness": float(w[0]), "opposite": 0.0, **side_parameter} if w[0] > 0 else None

    return convert_weight


def make_dynamic_laws(channel: int, scales: Scales) -> Iterator[Law]:
    """Make pose-dependent inertia (not for a shaft that turns), an extra mode on a grid of frequencies and damping
    ratios, and amplifier lag along a channel."""
    if not scales.turns_freely:
        # Lagrange's equation of a mass M (1 + c x) adds M c (x a + v² / 2) to M a; the weight is M c.
        yield Law(
            "pose_dependent_inertia", channel, (),
            lambda motion, _: motion.position[:, [channel]] * motion.acceleration[:, [channel]]
            + 0.5 * motion.velocity[:, [channel]] ** 2,
            # An inertia is positive wherever the axis was.
            lambda w, n, mass: {"per_m": float(w[0] / mass), "speed_share": 0.5}
            if mass > 0 and mass + min(w[0] * scales.low, w[0] * scales.high) > 0 else None,
        )  # fmt: skip
    for damping_ratio in MODE_DAMPING_RATIOS:
        for frequency_hz in scales.band_hz * np.array(MODE_FREQUENCIES):
            yield Law(
                "extra_mode", channel, (float(frequency_hz), damping_ratio),
                lambda motion, n: _compute_mode_force(motion, channel, n), _convert_mode_weight,
                is_linear=True, bounds=((0.005 * scales.band_hz, 1.5 * scales.band_hz), (0.002, 1.0)),
            )  # fmt: skip
    # With a first-order lag, the command is (1 + T s) times the delivered force. Only T s M a is no base term.
    yield Law(
        "amplifier_lag", channel, (),
        lambda motion, _: filter_from_rest(motion.acceleration[:, [channel]], motion.rate_hz, lambda s: s),
        lambda w, n, mass: {"time_constant": float(w[0] / mass)} if mass > 0 and w[0] > 0 else None, is_linear=True,
    )  # fmt: skip


def _compute_mode_force(motion: Motion, channel: int, n: NonlinearParameters) -> FloatArray:
    """Compute (samples, 1): force per kg of a body on a spring and damper at the axis: the axis acceleration times
    (omega² + 2 zeta omega s) / (s² + 2 zeta omega s + omega²). n: frequency (Hz) and damping ratio zeta."""
    omega, damping = 2 * np.pi * n[0], 2 * n[1] * 2 * np.pi * n[0]
    return filter_from_rest(
        motion.acceleration[:, [channel]],
        motion.rate_hz,
        lambda s: (omega**2 + damping * s) / (s**2 + damping * s + omega**2),
    )


def _convert_mode_weight(w: FloatArray, n: NonlinearParameters, mass: float) -> dict[str, float] | None:
    """Return frequency (Hz), mass (the weight; kg or kg m²) and damping ratio; None where the mass is not positive."""
    return {"frequency": n[0], "mass": float(w[0]), "damping_ratio": n[1]} if w[0] > 0 else None
