"""Force balance as the base model of a comparison with reference recordings: the device without the fault.

Per driven axis, F = M a + D v + K q + c + sum of w phi(q, v): linear regression of the force on the motion of all
measured channels, a constant, and nonlinear laws phi that lower the cross-validated error (`balance.regression`). The
laws only make the base accurate; none of them is named.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.balance.law import Law, scales_of
from analysis.diagnosis.balance.laws import cogging_law, laws_of, likely_pitches
from analysis.diagnosis.balance.motion import Motion, band_pass, compute_motions
from analysis.diagnosis.balance.regression import Regression, keep_laws, regression_of
from analysis.diagnosis.contrast.part import Part
from analysis.diagnosis.settings import BASE_LAW_GAIN, MOST_BASE_LAWS
from analysis.diagnosis.types import Mask
from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class ForceBase:
    """Base model of one driven axis: makes rows of the force and of the columns (regressors) that predict it."""

    axis: int
    laws: tuple[Law, ...]
    band_hz: float
    """Upper end of the band (Hz) to which force and columns are filtered."""
    turns: bool
    """Whether a shaft rotates freely, so that the balance has no stiffness (see `Scales`)."""
    rate_hz: float
    """Sample rate of the rows (Hz), after decimation."""
    lowest_hz: float = 0.0
    """Lower end of the band (Hz), see `Motion`."""

    def rows(
        self, parts: Sequence[Part], reusable_rows: tuple[FloatArray, ...] | None = None
    ) -> tuple[FloatArray, ...]:
        """Per part, (kept samples, 1 + columns): the force first. reusable_rows: rows of parts with the same motion,
        whose columns are reused, so that only the force is filtered again."""
        if reusable_rows is not None:
            commands = (
                band_pass(part.command[:, [self.axis]], part.rate_hz, self.band_hz, self.lowest_hz) for part in parts
            )
            step = round(parts[0].rate_hz / self.rate_hz)
            return tuple(
                np.hstack([target[::step], old_rows[:, 1:]])
                for target, old_rows in zip(commands, reusable_rows, strict=True)
            )
        motions = compute_motions([part.to_observed() for part in parts], self.band_hz)
        targets = [motion.decimate(motion.force[:, [self.axis]]) for motion in motions]
        base_regression = regression_of(motions, self.axis, (), self.turns)
        part_rows = []
        for target, motion, base in zip(targets, motions, base_regression.columns, strict=True):
            law_columns = [motion.decimate(law.columns(motion, law.numbers)) for law in self.laws]
            part_rows.append(np.hstack([target, base, *law_columns]))
        return tuple(part_rows)

    def valid_samples(self, parts: Sequence[Part]) -> tuple[Mask, ...]:
        """Per part, mask of its rows (kept samples,): known samples more than a filter length from the part's ends."""
        return tuple(
            motion.valid_samples(part.known)
            for motion, part in zip(
                compute_motions([part.to_observed() for part in parts], self.band_hz), parts, strict=True
            )
        )


def force_base(motions: Sequence[Motion], axis: int, rotational: bool) -> ForceBase:
    """Base model of one axis, with laws selected: first of the general laws, then with cogging at the pitches that the
    residual force shows. motions: of the compared recordings; all known samples are fitted to."""
    scales = [scales_of(motions, channel, rotational) for channel in range(len(motions[0].channels))]
    turns = any(scale.turns for scale in scales)
    regression = regression_of(motions, axis, list(laws_of(motions, rotational)), turns)
    residuals = regression.remainder(regression.columns_of(_select_laws(regression)))
    cogging_laws = [
        cogging_law(channel, pitch, scale)
        for channel, scale in enumerate(scales)
        for pitch in likely_pitches(motions, residuals, channel, scale)
    ]
    if cogging_laws:
        regression = regression_of(motions, axis, (*regression.laws, *cogging_laws), turns)
    return ForceBase(
        axis,
        keep_laws(regression, _select_laws(regression)).laws,
        motions[0].band_hz,
        turns,
        motions[0].rate_hz / motions[0].step,
        motions[0].lowest_hz,
    )


def _select_laws(regression: Regression) -> tuple[int, ...]:
    """Indices of the laws by forward selection: adds the best law while it lowers the cross-validated squared error by
    at least the share `BASE_LAW_GAIN`, up to `MOST_BASE_LAWS` laws."""
    laws: tuple[int, ...] = ()
    error = float(regression.cross_validated_errors(regression.columns_of(laws)).sum())
    while len(laws) < MOST_BASE_LAWS:
        trials = [
            (float(regression.cross_validated_errors(regression.columns_of((*laws, number))).sum()), number)
            for number in range(len(regression.laws))
            if number not in laws
        ]
        if not trials or min(trials)[0] > (1 - BASE_LAW_GAIN) * error:
            break
        error, best = min(trials)
        laws = (*laws, best)
    return laws
