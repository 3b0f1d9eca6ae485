"""Force balance of each axis of the recordings: the regression M a + B v + K x + laws = command.

Begin at `find_balances`, which is called by `diagnose` and `first_model.fit_without_model`.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from analysis.diagnosis.balance.actuator import DrivenAxis, find_balance
from analysis.diagnosis.balance.actuator_equivalents import withdraw_ambiguous_names
from analysis.diagnosis.balance.compare_free_laws import compare_with_free_laws
from analysis.diagnosis.balance.judge_laws import Balance, judge_laws
from analysis.diagnosis.balance.linear_part import find_driven_channels, search_with_linear_part
from analysis.diagnosis.balance.motion import (
    Motion,
    NoMotionError,
    compute_motion_band_hz,
    compute_motions,
    find_motion_signals,
)
from analysis.diagnosis.data.measured_motion import is_free_motion
from analysis.diagnosis.data.observed import Observed
from analysis.diagnosis.data.observed_parts import observe_parts
from analysis.diagnosis.data.readings_at_limit import stays_at_limit
from analysis.diagnosis.limits import MOVING_TIME_SHARE, SECOND_BAND_SHARE, STILL_SHARE
from analysis.diagnosis.types import Mapper, Mask, TimeBudget
from analysis.wording import conjoin
from equalizer.plant.mechanical_model import DERIVATIVE_OF_QUANTITY
from equalizer.signals.recording import Recording

ACTUATOR_LAWS = frozenset({"amplifier_lag"})
"""Laws of the motion that an actuator causes: left out where the motion was imposed or free, so that none acts."""
FREE_HARMONIC = 3.0
"""Highest harmonic of a free motion in the band in which the device moves: a free motion is nearly a single line, and
the third harmonic is the first in which the force of an odd law, such as a weight, differs from a spring's."""


def find_balances(
    recordings: Sequence[Recording], excluded: frozenset[str], time_left: TimeBudget, map_: Mapper = map
) -> tuple[Balance, ...]:
    """Find the force balance of each command; empty where no motion was measured, or too little of it for a fit.
    recordings: at least one, with the same channels. excluded: names of effects that are left out, of the catalogue or
    of `FREE_LAWS`. Where all axes can be tested and no law is named in the band that noise allows (`band.py`), the
    narrower band in which the device moves is tried, because power of the command above that band hides laws; then the
    samples in motion alone. Laws outside the catalogue are compared with the result. No law is named from accelerations
    that stay at a limit."""
    is_imposed = any(recording.meta.get("imposed") for recording in recordings)
    excluded |= ACTUATOR_LAWS if is_imposed else frozenset()
    try:
        records = observe_parts(recordings, len(recordings[0].response.channels))
        motions = compute_motions(records)
        balances = _fit_balances(motions, recordings, excluded, time_left, map_)
    except (NoMotionError, np.linalg.LinAlgError):
        return ()
    if clipped_channels := _find_clipped_accelerations(recordings, motions):
        reason = f"{conjoin(clipped_channels)} stays at the limit of its sensor, so that the forces lack its peaks"
        return tuple(balance.withdraw_names(reason) for balance in balances)
    for select in (restrict_to_motion_band, select_samples_in_motion):
        if any(balance.named or not balance.tested for balance in balances) or not time_left():
            break
        balances = balance_selected_motions(select, records, motions, excluded, time_left, map_) or balances
    compared_balances = [compare_with_free_laws(balance, excluded) if time_left() else balance for balance in balances]
    return tuple(
        balance if balance is catalogue_balance or is_imposed else withdraw_ambiguous_names(balance)
        for balance, catalogue_balance in zip(compared_balances, balances, strict=True)
    )


def _find_clipped_accelerations(recordings: Sequence[Recording], motions: Sequence[Motion]) -> list[str]:
    """Find the channels of accelerations that stay at a limit; none where positions or speeds were measured: a device
    may rest at a stop, or keep its speed, but under changing forces it does not keep its largest acceleration."""
    if motions[0].order < 2:
        return []
    samples = np.vstack([signal.samples for signal in find_motion_signals(recordings)])
    return [name for name, readings in zip(motions[0].channels, samples.T, strict=True) if stays_at_limit(readings)]


MotionSelector = Callable[[Sequence[Observed], Sequence[Motion]], Sequence[Motion]]
"""Maps records and their motions to motions with a narrower band or fewer samples; empty where little would change."""


def balance_selected_motions(
    select: MotionSelector,
    records: Sequence[Observed],
    motions: Sequence[Motion],
    excluded: frozenset[str],
    time_left: TimeBudget,
    map_: Mapper,
) -> tuple[Balance, ...]:
    """Compute the balances of the motions that `select` returns; empty where these name no law, or cannot be fitted."""
    try:
        selected = select(records, motions)
        recordings = [record.recording for record in records]
        balances = _fit_balances(selected, recordings, excluded, time_left, map_) if selected else ()
    except (NoMotionError, np.linalg.LinAlgError):
        return ()
    return balances if any(balance.named for balance in balances) else ()


def restrict_to_motion_band(records: Sequence[Observed], motions: Sequence[Motion]) -> Sequence[Motion]:
    """Filter the motions to the band of the driven motions; empty where that band is hardly narrower. A further
    measured motion, such as the deflection of a beam, may be mere noise at high frequencies. The band of a free motion
    reaches to `FREE_HARMONIC` times its highest frequency: no command has power there. Raises NoMotionError where a
    record contains no motion."""
    harmonic = FREE_HARMONIC if is_free_motion(records[0].recording) else 1.0
    narrow_hz = harmonic * compute_motion_band_hz(motions, find_driven_channels(motions))
    return compute_motions(records, narrow_hz) if narrow_hz < SECOND_BAND_SHARE * motions[0].band_hz else ()


def select_samples_in_motion(records: Sequence[Observed], motions: Sequence[Motion]) -> Sequence[Motion]:
    """Restrict the masks of the motions to the samples in which the device moves; empty where it moves most of the
    time. At rest, friction balances any applied force: no law predicts that force, and linear terms would be fitted to
    it."""
    moving_masks = [_find_moving_samples(motion, motions) for motion in motions]
    if np.mean(np.concatenate(moving_masks)) > MOVING_TIME_SHARE:
        return ()
    return [
        replace(motion, fit=motion.fit & is_moving, test=motion.test & is_moving)
        for motion, is_moving in zip(motions, moving_masks, strict=True)
    ]


def _find_moving_samples(motion: Motion, motions: Sequence[Motion]) -> Mask:
    """Find (n,): whether the squared velocity of any channel exceeds `STILL_SHARE` of its mean square over the samples
    to fit of all motions."""
    mean_square_velocity = np.concatenate(
        [fitted_motion.velocity[fitted_motion.fit] ** 2 for fitted_motion in motions]
    ).mean(axis=0)
    return np.asarray((motion.velocity**2 > STILL_SHARE * mean_square_velocity).any(axis=1))


def _fit_balances(
    motions: Sequence[Motion],
    recordings: Sequence[Recording],
    excluded: frozenset[str],
    time_left: TimeBudget,
    map_: Mapper,
) -> tuple[Balance, ...]:
    """Fit the balance of each command. Raises NoMotionError without samples to fit, LinAlgError for a singular fit."""
    rotational = any(unit.startswith("rad") for unit in recordings[0].response.units)
    rotational |= any(unit.startswith("N m") for unit in recordings[0].command.units)
    axes = range(len(recordings[0].command.channels))
    # With an imposed motion, the force is the response of the device, so that no actuator needs to be tested.
    if any(recording.meta.get("imposed") for recording in recordings):
        return tuple(
            judge_laws(search_with_linear_part(motions, axis, rotational, excluded, time_left)) for axis in axes
        )
    targets = [
        None if quantity == "voltage" else DERIVATIVE_OF_QUANTITY.get(quantity)
        for quantity in recordings[0].command.quantities
    ]
    return tuple(
        withdraw_ambiguous_names(
            find_balance(motions, DrivenAxis(axis, rotational, targets[axis]), excluded, time_left, map_)
        )
        for axis in axes
    )
