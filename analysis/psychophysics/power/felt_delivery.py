"""Delivered stimuli for simulated participants: strength, coupling and harmonics by frequency, direction and level.

Model of `study.participants.delivered_feeler`: the felt amplitude is sqrt(along^2 - across^2), harmonics add to the
threshold in squares, and the threshold rises during a run (adaptation). The level matters, because friction absorbs
weak forces.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from analysis.psychophysics.cues.delivered_cues import Cue, DeliveredTrials, select_delivered_trials
from equalizer.signals.signal import FloatArray
from protocols.trial import Trial

DeliveryRow = tuple[float, float, float, float]
"""Level in dB re 1 N; amplitudes along, across, and of harmonics, over that of an ideal device at this level."""
DeliveryTable = tuple[DeliveryRow, ...]
"""Delivery by rising level; interpolated linearly over dB, constant beyond the ends."""


@dataclass(frozen=True, slots=True)
class FeltDelivery:
    """Tables of the delivered stimulus by frequency and direction, with masking and adaptation of simulated people."""

    tables: tuple[tuple[DeliveryTable, DeliveryTable], ...]
    """Per frequency of the crowd: of the sides +1 and -1 of `DeliveredTrials`, which a simulated study takes for its
    sides +1 and -1; the protocol's numbers of the directions are not used."""
    masking: float = 1.0
    """Factor by which harmonics add to the threshold, in squares (masking)."""
    adaptation_db: float = 1.0
    """Rise of the threshold in a long run, dB."""
    adaptation_trials: float = 20.0
    """Time constant of adaptation, in trials."""


def tabulate_felt_delivery(
    trials: Iterable[Trial], frequencies_hz: Sequence[float], ideal_mps2_per_n: Sequence[float]
) -> FeltDelivery:
    """Tabulate medians over the measured test trials, by played levels rounded to 1 dB. ideal_mps2_per_n: gain of an
    ideal device along the direction, at each frequency. Coupling or harmonics that no trial of a level measured count
    as 0. Raises ValueError where a frequency lacks a measured direction."""
    groups_by_frequency = {group.frequency_hz: group for group in select_delivered_trials(trials)}
    if missing_frequencies := [
        f"{frequency:g} Hz"
        for frequency in frequencies_hz
        if frequency not in groups_by_frequency or len(set(groups_by_frequency[frequency].side.tolist())) < 2
    ]:
        raise ValueError(f"no measured trials of both directions at {', '.join(missing_frequencies)}")
    return FeltDelivery(
        tuple(
            (
                _tabulate_direction(groups_by_frequency[frequency_hz], 1.0, ideal_gain),
                _tabulate_direction(groups_by_frequency[frequency_hz], -1.0, ideal_gain),
            )
            for frequency_hz, ideal_gain in zip(frequencies_hz, ideal_mps2_per_n, strict=True)
        )
    )


def _tabulate_direction(group: DeliveredTrials, side: float, ideal_mps2_per_n: float) -> DeliveryTable:
    """Tabulate the delivery of one direction, by rising level. side: +1 or -1, as in `DeliveredTrials`; the gain of an
    ideal device is in m/s^2 per N."""
    # Over the level that was played: that of the staircase differs from it where levels were roved.
    gain_db = group.values_db[Cue.INTENSITY] + group.nominal_db - group.played_db
    relative_gain = 10.0 ** (gain_db / 20.0) / ideal_mps2_per_n
    columns = (
        relative_gain,
        relative_gain * _compute_amplitude_ratio(group, Cue.COUPLING),
        relative_gain * _compute_amplitude_ratio(group, Cue.SPECTRUM),
    )
    rounded_level_db = np.round(group.played_db)
    rows: list[DeliveryRow] = []
    for level_db in np.unique(rounded_level_db[group.side == side]):
        is_at_level = (group.side == side) & (rounded_level_db == level_db)
        on_axis, off_axis, harmonics = (_compute_measured_median(column[is_at_level]) for column in columns)
        if on_axis is not None:
            rows.append((float(level_db), on_axis, off_axis or 0.0, harmonics or 0.0))
    return tuple(rows)


def _compute_measured_median(values: FloatArray) -> float | None:
    """Compute the median of the finite values; None without any."""
    measured = values[np.isfinite(values)]
    return float(np.median(measured)) if len(measured) else None


def _compute_amplitude_ratio(group: DeliveredTrials, cue: Cue) -> FloatArray:
    """Compute the amplitude (n,) across the direction (`Cue.COUPLING`) or of the harmonics (`Cue.SPECTRUM`), relative
    to that along it, from the cue's value 20 log10(1 + ratio); NaN where it was not measured."""
    values_db = group.values_db.get(cue)
    return np.full(len(group.side), np.nan) if values_db is None else 10.0 ** (values_db / 20.0) - 1.0
