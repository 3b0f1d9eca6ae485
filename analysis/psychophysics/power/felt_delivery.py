"""Stimuli of a device as simulated people feel them: strength, coupling and harmonics by frequency, direction and
level.

As `study.participants.delivered_feeler`: the felt amplitude is sqrt(along^2 - across^2), harmonics add to the threshold
in squares, and the threshold rises during a run (adaptation). The level matters, because friction absorbs weak forces.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from analysis.psychophysics.cues.delivered_cues import Cue, DeliveredTrials, select_delivered_trials
from equalizer.signals.signal import FloatArray
from protocols.trial import Trial

Row = tuple[float, float, float, float]
"""Level in dB re 1 N; amplitudes along, across, and of harmonics, over that of a flawless device at this level."""
Table = tuple[Row, ...]
"""Delivery by rising level; interpolated linearly over dB, constant beyond the ends."""


@dataclass(frozen=True, slots=True)
class FeltDelivery:
    """Tables of the delivered stimulus by frequency and direction, with masking and adaptation of simulated people."""

    tables: tuple[tuple[Table, Table], ...]
    """Per frequency of the crowd: of direction 1 and 2."""
    masking: float = 1.0
    """Factor by which harmonics add to the threshold, in squares (masking)."""
    adaptation_db: float = 1.0
    """Rise of the threshold in a long run."""
    adaptation_trials: float = 20.0
    """Time constant of adaptation, in trials."""


def felt_delivery(
    trials: Iterable[Trial], frequencies_hz: Sequence[float], flawless_mps2_per_n: Sequence[float]
) -> FeltDelivery:
    """Medians over the measured test trials, by played levels rounded to 1 dB. flawless_mps2_per_n: along the
    direction, at each frequency. What no trial of a level was measured for counts as absent. Raises ValueError where a
    frequency lacks a measured direction."""
    groups = {group.frequency_hz: group for group in select_delivered_trials(trials)}
    if missing := [f"{f:g} Hz" for f in frequencies_hz if f not in groups or len(set(groups[f].side.tolist())) < 2]:
        raise ValueError(f"no measured trials of both directions at {', '.join(missing)}")
    return FeltDelivery(
        tuple(
            (
                _delivery_table(groups[frequency_hz], 1.0, flawless),
                _delivery_table(groups[frequency_hz], -1.0, flawless),
            )
            for frequency_hz, flawless in zip(frequencies_hz, flawless_mps2_per_n, strict=True)
        )
    )


def _delivery_table(group: DeliveredTrials, side: float, flawless: float) -> Table:
    # Over the level that was played: that of the staircase differs from it where levels were roved.
    over_played_db = group.values_db[Cue.INTENSITY] + group.nominal_db - group.played_db
    strength = 10.0 ** (over_played_db / 20.0) / flawless
    columns = (
        strength,
        strength * _amplitude_ratio(group, Cue.COUPLING),
        strength * _amplitude_ratio(group, Cue.SPECTRUM),
    )
    rounded = np.round(group.played_db)
    rows: list[Row] = []
    for level_db in np.unique(rounded[group.side == side]):
        of_level = (group.side == side) & (rounded == level_db)
        on_axis, off_axis, harmonics = (_median(column[of_level]) for column in columns)
        if on_axis is not None:
            rows.append((float(level_db), on_axis, off_axis or 0.0, harmonics or 0.0))
    return tuple(rows)


def _median(values: FloatArray) -> float | None:
    """Median over the trials that were measured; None where none was."""
    measured = values[np.isfinite(values)]
    return float(np.median(measured)) if len(measured) else None


def _amplitude_ratio(group: DeliveredTrials, cue: Cue) -> FloatArray:
    """Amplitude over that along the direction (n,), of which the cue holds the sum; NaN where it was not measured."""
    values_db = group.values_db.get(cue)
    return np.full(len(group.side), np.nan) if values_db is None else 10.0 ** (values_db / 20.0) - 1.0
