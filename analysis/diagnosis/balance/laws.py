"""Terms that physics may add to the force balance of a moving axis, each over a grid of its nonlinear numbers.

A law's force is linear in its weights: sum of weight times column, with columns from the measured motion. The grids
span the recording's speeds, travel and band, so that no starting values are needed.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from analysis.diagnosis.balance.friction_laws import damping_laws, friction_laws
from analysis.diagnosis.balance.law import Law, Scales, name_weights, relative_time, scales_of
from analysis.diagnosis.balance.motion import Motion
from analysis.diagnosis.balance.stiffness_laws import dynamic_laws, stiffness_laws
from equalizer.signals.signal import FloatArray


def laws_of(motions: Sequence[Motion], rotational: bool) -> Iterator[Law]:
    """All laws of all channels, but `cogging_law`, whose pitch is found from the residual of the others."""
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


def _longest_pitch(of: Scales) -> float:
    """Half the travel, or half a turn: an unbalanced or eccentric shaft has a period of one turn."""
    return min(0.5 * of.travel, np.pi) if of.rotational else 0.5 * of.travel


def cogging_law(channel: int, pitch: float, of: Scales) -> Law:
    """A force that is periodic in the position."""
    longest = _longest_pitch(of)
    return Law(
        "cogging", channel, (pitch,),
        lambda m, n: np.hstack(
            [np.sin(2 * np.pi * m.position[:, [channel]] / n[0]), np.cos(2 * np.pi * m.position[:, [channel]] / n[0])]
        ),
        # Opposite signs: the catalogue's force drives the motion, that of the balance resists it.
        lambda w, n, mass: {
            "amplitude": float(np.hypot(*w)), "pitch": n[0], "phase": float(np.arctan2(-w[1], -w[0])),
        } if n[0] <= longest else None,
        bounded=((0.9 * pitch, min(1.1 * pitch, longest)),),
    )  # fmt: skip


def likely_pitches(
    motions: Sequence[Motion], remainders: Sequence[FloatArray], channel: int, of: Scales
) -> list[float]:
    """Pitches of the four strongest lines in the spectrum of the residual force over the position, the strongest first.
    remainders: per motion, (kept samples,)."""
    q = np.concatenate([each.position[:: each.step, channel][each.valid_samples(each.fit)] for each in motions])
    left = np.concatenate([r[each.valid_samples(each.fit)] for each, r in zip(motions, remainders, strict=True)])
    longest = _longest_pitch(of)
    # Shorter pitches give frequencies above the band's end at the usual speed.
    shortest = max(of.speed / of.band_hz, longest / 400)
    if shortest >= longest or not len(left):
        return []
    finest = 1 / (2 * np.pi) if of.turns else 1 / of.travel
    lines = np.arange(1 / longest, 1 / shortest, finest * (1.0 if of.turns else 0.35))[:600]
    every = max(len(q) // 6000, 1)
    power = np.array([abs(np.mean(left[::every] * np.exp(-2j * np.pi * line * q[::every]))) for line in lines])
    peaks = [k for k in range(len(power)) if power[k] == power[max(k - 2, 0) : k + 3].max()]
    return [float(1 / lines[k]) for k in sorted(peaks, key=lambda k: -power[k])[:4]]
