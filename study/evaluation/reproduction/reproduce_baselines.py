"""Play baseline methods of equalization on the simulated device, for comparison with the equalizer.

Each method is played at the centre of the workspace, near its edge, and in a simulated hand. All baselines are designed
from the data of the centre without a hand; `equalizer.tracking.feedforward.baselines` defines them.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from analysis.evaluation.reproduction.played_response import PlayedResponse, mask_lines_in_band
from equalizer.identification.frequency_response.frequency_response import FrequencyResponse
from equalizer.signals.signal import FloatArray, Signal
from equalizer.tracking.feedforward.baselines import Inverse, compute_baseline_inverses
from equalizer.tracking.workspace.blended_inverse import blend_at
from study.evaluation.reproduction.reproduce_equalized import (
    PlacedModels,
    make_blending_driver,
    make_single_model_driver,
)
from study.evaluation.reproduction.reproduce_playback import Driver, PlaybackRow, play_row
from study.evaluation.reproduction.reproduction_plan import CENTRE, EDGE, Place, ReproductionPlan


@dataclass(frozen=True, slots=True)
class _Placement:
    """Condition of a comparison: place of the handle, and whether a simulated hand holds it."""

    description: str
    """Words for the condition in the name of a row."""
    place_m: Place
    """Position of the handle (m)."""
    hand: bool
    """Whether a simulated hand holds the handle."""


_PLACEMENTS = (
    _Placement("centre", CENTRE, False),
    _Placement("edge", EDGE, False),
    _Placement("in the hand", CENTRE, True),
)
"""Conditions under which the methods are compared."""


def play_baselines(
    plan: ReproductionPlan,
    models: PlacedModels,
    frequency_response: FrequencyResponse,
    on_progress: Callable[[float], None],
) -> tuple[PlayedResponse, ...]:
    """Play all baselines under each condition; at the edge and in the hand, they are followed by the equalizer that was
    designed for this condition.

    frequency_response: of the device at the centre, including the spring. on_progress: called with the fraction done, 0
    to 1.
    """
    baseline_inverses = compute_baseline_inverses(
        models.centre, frequency_response, _list_band_frequencies_hz(plan, models.centre.sample_rate_hz)
    )
    row_count = len(_PLACEMENTS) * len(baseline_inverses) + 2
    responses: list[PlayedResponse] = []
    for placement in _PLACEMENTS:
        for inverse in baseline_inverses:
            row = PlaybackRow(
                f"{inverse.name}, {placement.description}",
                _make_driver(plan, inverse),
                placement.place_m,
                hand=placement.hand,
            )
            response = replace(play_row(plan, row), multiply_adds=inverse.multiply_adds)
            responses.append(response)
            on_progress(len(responses) / row_count)
        responses += [play_row(plan, row) for row in _make_equalizer_rows(placement, models)]
        on_progress(len(responses) / row_count)
    return tuple(responses)


def _make_equalizer_rows(placement: _Placement, models: PlacedModels) -> tuple[PlaybackRow, ...]:
    """Make the row of the equalizer designed for a condition: from the model identified in the hand, or at the edge
    from the blended models of other places; none at the centre."""
    if placement.hand:
        return (PlaybackRow("model identified in the hand", make_single_model_driver(models.hand), hand=True),)
    if placement.place_m == EDGE:
        return (
            PlaybackRow(
                "models of other places, blended, edge", make_blending_driver(blend_at(models.workspace, EDGE)), EDGE
            ),
        )
    return ()


def _list_band_frequencies_hz(plan: ReproductionPlan, rate_hz: float) -> FloatArray:
    """List the frequencies (lines,), Hz, of the spectral lines in the band, for the period of the plan. rate_hz: sample
    rate."""
    period_samples = round(plan.period_s * rate_hz)
    return np.asarray(
        np.fft.rfftfreq(period_samples, 1 / rate_hz)[mask_lines_in_band(plan.band_hz, period_samples, rate_hz)],
        dtype=np.float64,
    )


def _make_driver(plan: ReproductionPlan, inverse: Inverse) -> Driver:
    """Make the driver that multiplies the spectrum of one period of the target acceleration by the inverse, line by
    line in the band, to give the forces (n, axes), N; they have no spectral lines outside the band."""

    def drive(target: Signal) -> FloatArray:
        band_lines = mask_lines_in_band(plan.band_hz, len(target), target.sample_rate_hz)
        target_spectrum = np.fft.rfft(target.samples, axis=0)
        force_spectrum = np.zeros((len(target_spectrum), inverse.response.shape[1]), dtype=complex)
        force_spectrum[band_lines] = np.einsum("lmp,lp->lm", inverse.response, target_spectrum[band_lines])
        return np.asarray(np.fft.irfft(force_spectrum, len(target), axis=0), dtype=np.float64)

    return drive
