"""Play baseline methods of equalization on the simulated device, for comparison with the equalizer.

Each method is played at the centre of the workspace, near its edge, and in a simulated hand. All baselines are designed
from the data of the centre without a hand; `equalizer.tracking.feedforward.baselines` defines them.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from analysis.evaluation.reproduction.played_response import PlayedResponse, lines_of_band
from equalizer.identification.frequency_response.frequency_response import FrequencyResponse
from equalizer.signals.signal import FloatArray, Signal
from equalizer.tracking.feedforward.baselines import Inverse, baseline_inverses
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
    """Place of the handle (m), and whether a simulated hand holds it. words: its description in the name of a row."""

    words: str
    place_m: Place
    hand: bool


_PLACEMENTS = (
    _Placement("centre", CENTRE, False),
    _Placement("edge", EDGE, False),
    _Placement("in the hand", CENTRE, True),
)
"""Conditions under which the methods are compared."""


def play_baselines(
    plan: ReproductionPlan, models: PlacedModels, estimate: FrequencyResponse, on_share: Callable[[float], None]
) -> tuple[PlayedResponse, ...]:
    """Play all baselines under each condition; at the edge and in the hand, they are followed by the equalizer that was
    designed for this condition.

    estimate: frequency response at the centre, including the spring. on_share: called with the fraction done, 0 to 1.
    """
    inverses = baseline_inverses(models.centre, estimate, _lines_hz(plan, models.centre.sample_rate_hz))
    wanted = len(_PLACEMENTS) * len(inverses) + 2
    found: list[PlayedResponse] = []
    for where in _PLACEMENTS:
        for inverse in inverses:
            playing = PlaybackRow(
                f"{inverse.name}, {where.words}", _driver(plan, inverse), where.place_m, hand=where.hand
            )
            played = replace(play_row(plan, playing), multiply_adds=inverse.multiply_adds)
            found.append(played)
            on_share(len(found) / wanted)
        found += [play_row(plan, playing) for playing in _for_the_place(where, models)]
        on_share(len(found) / wanted)
    return tuple(found)


def _for_the_place(where: _Placement, models: PlacedModels) -> tuple[PlaybackRow, ...]:
    """The equalizer designed for a condition: from the model identified in the hand, or at the edge from the blended
    models of other places; none at the centre."""
    if where.hand:
        return (PlaybackRow("model identified in the hand", make_single_model_driver(models.hand), hand=True),)
    if where.place_m == EDGE:
        return (
            PlaybackRow(
                "models of other places, blended, edge", make_blending_driver(blend_at(models.workspace, EDGE)), EDGE
            ),
        )
    return ()


def _lines_hz(plan: ReproductionPlan, rate_hz: float) -> FloatArray:
    """(lines,): frequencies (Hz) of the spectral lines of one period that lie in the band."""
    period = round(plan.period_s * rate_hz)
    return np.asarray(
        np.fft.rfftfreq(period, 1 / rate_hz)[lines_of_band(plan.band_hz, period, rate_hz)], dtype=np.float64
    )


def _driver(plan: ReproductionPlan, inverse: Inverse) -> Driver:
    """The driver that multiplies the spectrum of the wanted acceleration by the inverse, line by line in the band;
    other lines are zero."""

    def drive(wanted: Signal) -> FloatArray:
        used = lines_of_band(plan.band_hz, len(wanted), wanted.sample_rate_hz)
        spectrum = np.fft.rfft(wanted.samples, axis=0)
        forces = np.zeros((len(spectrum), inverse.response.shape[1]), dtype=complex)
        forces[used] = np.einsum("lmp,lp->lm", inverse.response, spectrum[used])
        return np.asarray(np.fft.irfft(forces, len(wanted), axis=0), dtype=np.float64)

    return drive
