"""The force balances of recordings, one per command: in the band that noise allows, and in that of the motion."""

from collections.abc import Sequence

import numpy as np

from analysis.diagnosis.balance.actuator import balance_of
from analysis.diagnosis.balance.linear_part import search_beside_linear
from analysis.diagnosis.balance.motion import Motion, NoMotionError, motions_of, moving_band_hz
from analysis.diagnosis.balance.weigh import Balance, weigh
from analysis.diagnosis.data.observed import Observed
from analysis.diagnosis.data.observed_parts import observed_parts
from analysis.diagnosis.types import TimeBudget
from equalizer.signals.recording import Recording

NARROWER = 0.5
"""Share of the band that noise allows, below which the band of the motion is another look."""


def balances_of(recordings: Sequence[Recording], without: frozenset[str], time_left: TimeBudget) -> tuple[Balance, ...]:
    """One per command; none where no motion was measured, or too little of it. Where nothing is named in the band that
    noise allows, the band in which the device moves is looked at: a command's edges beyond it hide laws."""
    try:
        records = observed_parts(recordings, len(recordings[0].response.channels))
        motions = motions_of(records)
        found = _weighed_along(motions, recordings, without, time_left)
    except (NoMotionError, np.linalg.LinAlgError):
        return ()
    if any(balance.named or not balance.tested for balance in found) or not time_left():
        return found
    return _closer(records, motions, without, time_left) or found


def _closer(
    records: Sequence[Observed], motions: Sequence[Motion], without: frozenset[str], time_left: TimeBudget
) -> tuple[Balance, ...]:
    """In the band in which the device moves; none where that is hardly another, or names nothing."""
    narrow_hz = moving_band_hz(motions)
    if not narrow_hz < NARROWER * motions[0].band_hz:
        return ()
    try:
        found = _weighed_along(motions_of(records, narrow_hz), [each.recording for each in records], without, time_left)
    except (NoMotionError, np.linalg.LinAlgError):
        return ()
    return found if any(balance.named for balance in found) else ()


def _weighed_along(
    motions: Sequence[Motion], recordings: Sequence[Recording], without: frozenset[str], time_left: TimeBudget
) -> tuple[Balance, ...]:
    turning = any(unit.startswith("rad") for unit in recordings[0].response.units)
    turning |= any(unit.startswith("N m") for unit in recordings[0].command.units)
    axes = range(len(recordings[0].command.channels))
    if any(recording.meta.get("imposed") for recording in recordings):
        return tuple(weigh(search_beside_linear(motions, axis, turning, without, time_left)) for axis in axes)
    return tuple(balance_of(motions, axis, turning, without, time_left) for axis in axes)
