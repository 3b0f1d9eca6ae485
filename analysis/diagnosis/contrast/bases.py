"""Build the base models of a comparison: first a force balance where it fits, then an autoregressive model (ARX)."""

from collections.abc import Iterator, Sequence
from contextlib import suppress

import numpy as np

from analysis.diagnosis.balance.motion import Motion, NoMotionError, compute_motions
from analysis.diagnosis.contrast.autoregressive_base import AutoregressiveBase, choose_decimation_step
from analysis.diagnosis.contrast.compared_base import LEAST_ROWS, Base
from analysis.diagnosis.contrast.force_base import build_force_base
from analysis.diagnosis.contrast.recording_part import Part
from analysis.diagnosis.limits import AUTOREGRESSIVE_ORDER, CONSTANT_SIGNAL, MISFIT_SHARE, MOST_MOTION_RATIO
from analysis.diagnosis.types import Mask
from equalizer.signals.signal import FloatArray


def build_bases(clean: tuple[Part, ...], faulty: tuple[Part, ...]) -> Iterator[tuple[list[Base], tuple[Motion, ...]]]:
    """Build force balances, one per axis, where all explain the clean set to within `MISFIT_SHARE`; then
    autoregressive models, one per response. Each list comes with the motions of both sets, which are empty where no
    motion was measured. No force balance without a time axis (infinite band), or where a fit fails. clean: at least one
    part; faulty: may be empty."""
    recording = clean[0].recording
    is_rotational = recording.is_rotational
    motions: tuple[Motion, ...] = ()
    with suppress(NoMotionError):
        clean_motions = compute_motions([part.to_observed() for part in clean])
        faulty_motions = (
            compute_motions([part.to_observed() for part in faulty], clean_motions[0].band_hz) if faulty else ()
        )
        motions = (*clean_motions, *faulty_motions)
    force_bases: list[Base] = []
    if motions and np.isfinite(motions[0].band_hz):
        with suppress(np.linalg.LinAlgError, ValueError):
            bases: list[Base] = [
                build_force_base(motions, axis, is_rotational) for axis in range(len(recording.command.channels))
            ]
            force_bases = bases if all(compute_unexplained_share(base, clean) < MISFIT_SHARE for base in bases) else []
    if force_bases:
        yield force_bases, motions
    fewest_samples = min(sum(len(part.known) for part in part_set) for part_set in (clean, faulty) if part_set)
    decimation_step = max(min(choose_decimation_step((*clean, *faulty)), fewest_samples // (2 * LEAST_ROWS)), 1)
    response_count = len(recording.response.channels)
    yield (
        [
            AutoregressiveBase(channel, AUTOREGRESSIVE_ORDER, decimation_step, response_count)
            for channel in range(response_count)
        ],
        motions,
    )


def has_similar_motion(clean: tuple[Part, ...], faulty: tuple[Part, ...]) -> bool:
    """Whether the rms of each detrended response differs between the two sets by at most a factor `MOST_MOTION_RATIO`.
    Neither set is empty."""
    response_rms = np.array(
        [
            np.sqrt(np.mean([_compute_detrended_mean_squares(part) for part in part_set], axis=0))
            for part_set in (clean, faulty)
        ]
    )
    return bool(np.all(response_rms.max(axis=0) <= MOST_MOTION_RATIO * response_rms.min(axis=0)))


def _compute_detrended_mean_squares(part: Part) -> FloatArray:
    """Compute (p,): mean squares of the p responses about their least-squares lines."""
    shifts = np.arange(len(part.response)) - (len(part.response) - 1) / 2
    centred = part.response - part.response.mean(axis=0)
    return np.asarray(
        np.mean(
            (centred - shifts[:, None] * (shifts @ centred / max(float(shifts @ shifts), 1.0))) ** 2,
            axis=0,
        )
    )


def compute_unexplained_share(base: Base, parts: tuple[Part, ...]) -> float:
    """Compute the standard deviation of a base's least-squares residual over that of the signal; infinite where the
    signal is constant."""
    return compute_unexplained_share_of_rows(base, base.build_rows(parts), base.mask_valid_samples(parts))


def compute_unexplained_share_of_rows(base: Base, rows_by_part: Sequence[FloatArray], masks: Sequence[Mask]) -> float:
    """Compute the same as `compute_unexplained_share` from the rows (n, 1 + columns) of each part and the masks (n,) of
    valid rows. Columns are scaled to an rms of 1; directions with singular values below 1e-10 of the largest, which are
    rounding, are left out."""
    rows = np.vstack([part_rows[mask] for part_rows, mask in zip(rows_by_part, masks, strict=True)])
    signal = base.reconstruct_response(rows) if isinstance(base, AutoregressiveBase) else rows[:, 0]
    column_rms = np.maximum(np.sqrt(np.mean(rows**2, axis=0)), 1e-300)
    signal_std = float(np.std(signal))
    if signal_std <= CONSTANT_SIGNAL * float(np.sqrt(np.mean(signal**2))):
        return np.inf
    weights = np.linalg.lstsq(rows[:, 1:] / column_rms[1:], rows[:, 0], rcond=1e-10)[0]
    return float(np.std(rows[:, 0] - rows[:, 1:] / column_rms[1:] @ weights)) / signal_std
