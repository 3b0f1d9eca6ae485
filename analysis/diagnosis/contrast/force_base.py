"""Force balance as the base of a comparison with reference recordings. "Base" in this package: the nominal model, of
the device without the fault, beside which each possible fault is fitted. Built by `bases`.

Per driven axis, F = M a + D v + K q + c + sum of w phi: linear regression of the force on the motion of all measured
channels, a constant, and further laws phi of the motion, some of them linear or of the time (`balance.laws`), that
lower the cross-validated error (`balance.regression`). The laws only make the base accurate; none of them is reported.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.balance.change_laws import keep_laws
from analysis.diagnosis.balance.laws.law import Law, measure_scales
from analysis.diagnosis.balance.laws.motion_laws import find_likely_pitches, make_cogging_law, make_laws
from analysis.diagnosis.balance.motion import Motion, compute_motions, filter_band_pass
from analysis.diagnosis.balance.regression import Regression, build_regression
from analysis.diagnosis.contrast.recording_part import Part
from analysis.diagnosis.limits import BASE_LAW_GAIN, MOST_BASE_LAWS
from analysis.diagnosis.types import Mask
from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class ForceBase:
    """Nominal model of one driven axis: makes rows of the force and of the columns (regressors) that predict it."""

    axis: int
    """Index of the driven axis in the command."""
    laws: tuple[Law, ...]
    """Laws in addition to mass, damping, stiffness and constant; may be empty."""
    band_hz: float
    """Upper end of the band (Hz) to which force and columns are filtered."""
    turns_freely: bool
    """Whether a shaft rotates freely, so that the balance has no stiffness (see `Scales`)."""
    rate_hz: float
    """Sample rate of the rows (Hz), after decimation."""
    lowest_hz: float = 0.0
    """Lower end (Hz) of the band of the motions by which the laws were selected, see `Motion`; used for the force of
    reused rows only. For other rows `compute_motions` determines it anew from the parts' accelerations."""

    def build_rows(
        self, parts: Sequence[Part], reusable_rows: tuple[FloatArray, ...] | None = None
    ) -> tuple[FloatArray, ...]:
        """Build the rows of each part, (kept samples, 1 + columns): the force (N or N m) first. reusable_rows: rows of
        parts with the same motion, whose columns are reused, so that only the force is filtered again, with `lowest_hz`
        as lower end; that of the columns may differ slightly, where the motion is integrated from accelerations. Raises
        NoMotionError where a part contains no motion."""
        if reusable_rows is not None:
            filtered_forces = (
                filter_band_pass(part.command[:, [self.axis]], part.rate_hz, self.band_hz, self.lowest_hz)
                for part in parts
            )
            step = round(parts[0].rate_hz / self.rate_hz)
            return tuple(
                np.hstack([force_column[::step], previous_rows[:, 1:]])
                for force_column, previous_rows in zip(filtered_forces, reusable_rows, strict=True)
            )
        motions = compute_motions([part.to_observed() for part in parts], self.band_hz)
        force_columns = [motion.decimate(motion.force[:, [self.axis]]) for motion in motions]
        base_regression = build_regression(motions, self.axis, (), self.turns_freely)
        part_rows = []
        for force_column, motion, linear_columns in zip(force_columns, motions, base_regression.columns, strict=True):
            law_columns = [motion.decimate(law.make_columns(motion, law.numbers)) for law in self.laws]
            part_rows.append(np.hstack([force_column, linear_columns, *law_columns]))
        return tuple(part_rows)

    def mask_valid_samples(self, parts: Sequence[Part]) -> tuple[Mask, ...]:
        """Mask the rows of each part, (kept samples,): known samples more than a filter length from the part's ends."""
        return tuple(
            motion.mask_valid_samples(part.known)
            for motion, part in zip(
                compute_motions([part.to_observed() for part in parts], self.band_hz), parts, strict=True
            )
        )


def build_force_base(motions: Sequence[Motion], axis: int, is_rotational: bool) -> ForceBase:
    """Build the nominal model of one axis: select laws first among the general laws, then with cogging at the pitches
    that the residual force shows. motions: of the compared recordings."""
    scales = [measure_scales(motions, channel, is_rotational) for channel in range(len(motions[0].channels))]
    turns_freely = any(scale.turns_freely for scale in scales)
    regression = build_regression(motions, axis, list(make_laws(motions, is_rotational)), turns_freely)
    residuals = regression.compute_residuals(regression.select_columns(_select_laws(regression)))
    cogging_laws = [
        make_cogging_law(channel, pitch, scale)
        for channel, scale in enumerate(scales)
        for pitch in find_likely_pitches(motions, residuals, channel, scale)
    ]
    if cogging_laws:
        regression = build_regression(motions, axis, (*regression.laws, *cogging_laws), turns_freely)
    return ForceBase(
        axis,
        keep_laws(regression, _select_laws(regression)).laws,
        motions[0].band_hz,
        turns_freely,
        motions[0].rate_hz / motions[0].step,
        motions[0].lowest_hz,
    )


def _select_laws(regression: Regression) -> tuple[int, ...]:
    """Select laws (indices) by forward selection: add the best law while it lowers the cross-validated squared error by
    at least the share `BASE_LAW_GAIN`, up to `MOST_BASE_LAWS` laws."""
    selected_laws: tuple[int, ...] = ()
    error = float(regression.cross_validate(regression.select_columns(selected_laws)).sum())
    while len(selected_laws) < MOST_BASE_LAWS:
        trial_errors = [
            (float(regression.cross_validate(regression.select_columns((*selected_laws, law_index))).sum()), law_index)
            for law_index in range(len(regression.laws))
            if law_index not in selected_laws
        ]
        if not trial_errors or min(trial_errors)[0] > (1 - BASE_LAW_GAIN) * error:
            break
        error, best_law = min(trial_errors)
        selected_laws = (*selected_laws, best_law)
    return selected_laws
