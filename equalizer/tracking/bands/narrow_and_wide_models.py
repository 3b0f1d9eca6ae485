"""Banded feedforward from two models of the same place: an accurate one of a narrow band, and one of a wide band.

Low band, below the narrow model's band: a rigid model fitted to the narrow model's lowest lines. Middle: the narrow
model. High, above it: the wide model's response along one direction. Forces are played from the first to the last row
of the reference; those of the low and the high band before and after it (run-in and run-out) are cut off. The middle
band is then solved again for the reference minus the narrow model's response to what remains of them.
"""

from dataclasses import dataclass

import numpy as np

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.plant.model_response import compute_model_response
from equalizer.signals.signal import FloatArray, Signal
from equalizer.tracking.bands.banded_equalizer import BandedEqualizer, HighBand, LowBand
from equalizer.tracking.bands.banded_forces import BandedForces
from equalizer.tracking.bands.high_band import ModelledResponse, predict_acceleration
from equalizer.tracking.bands.rigid_model import RigidModel, fit_rigid_model
from equalizer.tracking.feedforward.band_split import BandEdges, LinearPhaseSplit
from equalizer.tracking.feedforward.feedforward import (
    BAND_MARGIN_HZ,
    LEAKAGE_SHARE,
    Feedforward,
    FeedforwardSettings,
    extract_band,
    solve_causally,
)
from equalizer.tracking.feedforward.periodic_inverse import check_reference
from equalizer.tracking.lqr.limits import require_under_cap
from equalizer.tracking.lqr.padding import compute_band_error, simulate_from_rest
from equalizer.tracking.lqr.tracking_problem import TrackingError, TrackingWeights, make_tracking_problem

RIGID_OCTAVES = 0.6
"""Width in octaves of the lowest part of the narrow band to which the rigid model is fitted: below the first
resonance. Chosen by hand."""
RIGID_LINES = 30
"""Number of lines, evenly spaced in the logarithm of frequency, at which the rigid model is fitted. Chosen by hand."""
LEAST_REACH = 2.0
"""Least ratio of the two bands' upper ends: a high band, whose force has a single direction, needs an octave. Chosen
by hand."""
BINS_PER_OCTAVE = 6
"""Bins per octave of `compute_level_error`. Chosen."""


@dataclass(frozen=True, slots=True, eq=False)
class TwoModels:
    """A narrow and a wide model. Raises ValueError unless the bands overlap and leave room for a low and a high band
    (`LEAST_REACH`), and where both state how they were identified, but differently."""

    narrow: IdentifiedModel
    wide: IdentifiedModel

    def __post_init__(self) -> None:
        (narrow_low_hz, narrow_high_hz), (wide_low_hz, wide_high_hz) = self.narrow.band_hz, self.wide.band_hz
        if not (
            wide_low_hz <= narrow_high_hz
            and wide_high_hz >= LEAST_REACH * narrow_high_hz
            and narrow_low_hz > 2 * BAND_MARGIN_HZ
        ):
            raise ValueError(
                f"bands of {narrow_low_hz:g} to {narrow_high_hz:g} Hz and {wide_low_hz:g} to {wide_high_hz:g} Hz "
                f"cannot be combined: the wider one must begin at {narrow_high_hz:g} Hz or below and reach "
                f"{LEAST_REACH * narrow_high_hz:g} Hz or more, the narrower one begin above {2 * BAND_MARGIN_HZ:g} Hz"
            )
        conditions = [[model.provenance.get(key) for key in ("hand", "input")] for model in (self.narrow, self.wide)]
        if conditions[0] != conditions[1] and None not in conditions[0] + conditions[1]:
            raise ValueError(
                f"the narrower one was made {_describe_conditions(self.narrow)}, the wider one "
                f"{_describe_conditions(self.wide)}: two bands must be of one device, held and driven alike"
            )


@dataclass(frozen=True, slots=True, eq=False)
class BandPredictions:
    """Predicted errors and other figures of a banded feedforward; errors are relative to the reference in the band."""

    edges_hz: tuple[float, float]
    """Crossover frequencies of the middle band to the low and to the high band."""
    cut_error: float
    """Error in the middle band if the run-in and run-out were cut off and the middle band not solved again."""
    uncut_error: float
    """Error in the middle band if the run-in and run-out were played."""
    level_error: float | None
    """Error of the high band's level, from `compute_level_error`; None for a reference without content in this band."""
    direction: tuple[float, ...]
    """Unit vector of the high band's force; empty without a high band."""
    travel_m: float
    """Largest displacement of the handle by the low band."""


@dataclass(frozen=True, slots=True, eq=False)
class BandedFeedforward:
    """Result of `solve_banded_feedforward`: forces, one row per row of the reference acceleration, and their
    figures."""

    feedforward: Feedforward
    """Forces of all bands; their `error` is that in the middle band, by the narrow model."""
    predictions: BandPredictions


def solve_banded_feedforward(models: TwoModels, reference: Signal, settings: FeedforwardSettings) -> BandedFeedforward:
    """Solve for the forces of all bands. Raises ForceLimitError above the cap, TrackingError where the reference has no
    content in the middle band or the cap leaves no solution, ValueError for an unsuitable signal or weight."""
    check_reference(models.narrow, reference)
    check_reference(models.wide, reference)
    equalizer, rate_hz = make_banded_equalizer(models, settings.weight), reference.sample_rate_hz
    in_band_reference = _remove_above_band(reference.samples, models.wide)
    banded_forces = equalizer.compute_forces(in_band_reference)
    rows = banded_forces.find_reference_rows(len(reference))
    if not np.linalg.norm(banded_forces.bands.middle[rows]) > LEAKAGE_SHARE * np.linalg.norm(reference.samples):
        low_hz, high_hz = models.narrow.band_hz
        raise TrackingError(
            f"the reference has no content from {low_hz:g} to {high_hz:g} Hz, the narrower model's band"
        )
    problem = make_tracking_problem(models.narrow, TrackingWeights(settings.weight))
    outer_forces = (banded_forces.by_band[0] + banded_forces.by_band[2])[rows]
    middle_reference = extract_band(models.narrow, in_band_reference - simulate_from_rest(problem, outer_forces))
    middle_forces, loss = solve_causally(problem, middle_reference, settings, outer_forces)
    forces = middle_forces + outer_forces
    predicted = simulate_from_rest(problem, forces)
    low_reference = (
        np.zeros_like(in_band_reference)
        if banded_forces.motion is None
        else banded_forces.motion.acceleration_mps2[rows]
    )
    total_reference = low_reference + (banded_forces.bands.middle + banded_forces.bands.high)[rows]
    solution = Feedforward(
        forces=Signal(forces, rate_hz, "force", "N", models.narrow.input_channels),
        reference=total_reference,
        predicted=predicted,
        error=compute_band_error(in_band_reference, predicted, rate_hz, models.narrow.band_hz),
        out_of_band_share=float(
            np.linalg.norm(reference.samples - total_reference) / np.linalg.norm(reference.samples)
        ),
        peaks=require_under_cap(forces, settings.cap_n, rate_hz),
        loss=loss,
    )
    return BandedFeedforward(solution, _predict_bands(models, equalizer, banded_forces, in_band_reference, forces))


def make_banded_equalizer(models: TwoModels, weight: float) -> BandedEqualizer:
    """Make the equalizer in three bands, split by linear-phase filters BAND_MARGIN_HZ beyond the narrow model's band on
    either side. weight: R = weight I, of |u|², (m/s² per N)². Raises ValueError for a weight outside 1e-3 to 1e-2."""
    low_hz, high_hz = models.narrow.band_hz
    edges = BandEdges(low_hz - BAND_MARGIN_HZ, high_hz + BAND_MARGIN_HZ)
    return BandedEqualizer(
        models.narrow,
        LinearPhaseSplit(edges, models.narrow.sample_rate_hz),
        LowBand(fit_rigid_part(models.narrow)),
        HighBand(ModelledResponse(models.wide)),
        TrackingWeights(weight),
    )


def fit_rigid_part(model: IdentifiedModel) -> RigidModel:
    """Fit a rigid model (mass, damping, stiffness) to the model's response in the lowest RIGID_OCTAVES of its band."""
    low_hz, high_hz = model.band_hz
    lines_hz = np.geomspace(low_hz, min(high_hz, low_hz * 2**RIGID_OCTAVES), RIGID_LINES)
    return fit_rigid_model(lines_hz, compute_model_response(model, lines_hz), model.sample_rate_hz)


def compute_level_error(
    reference: FloatArray, delivered: FloatArray, rate_hz: float, band_hz: tuple[float, float]
) -> float | None:
    """Compute the relative error of the level (root of the power of all axes together) in bins of about a sixth of an
    octave, for a band in which people perceive the level of a vibration but not its direction: |L_delivered -
    L_reference| / |L_reference|, with L (bins,) from the DFT, zero-padded to twice the length. reference, delivered:
    (n, axes). None where the reference has at most `LEAKAGE_SHARE` of its level in the band."""
    length = 2 * len(reference)
    lines_hz = np.fft.rfftfreq(length, 1 / rate_hz)
    bin_count = max(1, round(BINS_PER_OCTAVE * np.log2(band_hz[1] / band_hz[0])))
    bins = np.digitize(lines_hz, np.geomspace(*band_hz, bin_count + 1))
    levels = []
    for samples in (reference, delivered):
        power = (np.abs(np.fft.rfft(samples, length, axis=0)) ** 2).sum(axis=1)
        levels.append(np.sqrt(np.bincount(bins, power, minlength=bin_count + 2)))
    reference_level = float(np.linalg.norm(levels[0][1:-1]))
    if reference_level <= LEAKAGE_SHARE * float(np.linalg.norm(levels[0])):
        return None
    return float(np.linalg.norm((levels[1] - levels[0])[1:-1]) / reference_level)


def _remove_above_band(reference: FloatArray, wide: IdentifiedModel) -> FloatArray:
    """Remove frequencies above the wide band from the reference acceleration; unchanged where that band ends within
    twice BAND_MARGIN_HZ of half the sample rate."""
    edge_hz = wide.band_hz[1] + BAND_MARGIN_HZ
    if edge_hz + BAND_MARGIN_HZ >= wide.sample_rate_hz / 2:
        return reference
    bands = LinearPhaseSplit(BandEdges(None, edge_hz), wide.sample_rate_hz).split(reference)
    return bands.middle[bands.latency_samples : bands.latency_samples + len(reference)]


def _predict_bands(
    models: TwoModels,
    equalizer: BandedEqualizer,
    banded_forces: BandedForces,
    reference: FloatArray,
    forces: FloatArray,
) -> BandPredictions:
    """Predict the errors: the middle band's, of banded_forces, by the narrow model; the high band's, of the final
    forces (n, inputs), by the wide one. reference: (n, axes), without frequencies above the wide band."""
    edges, rows, middle_band_hz = (
        equalizer.split.edges,
        banded_forces.find_reference_rows(len(reference)),
        models.narrow.band_hz,
    )
    rate_hz, problem = models.narrow.sample_rate_hz, make_tracking_problem(models.narrow, equalizer.weights)
    full_response, cut_response = (
        simulate_from_rest(problem, banded_forces.total_forces)[rows],
        simulate_from_rest(problem, banded_forces.total_forces[rows]),
    )
    high_band_hz = middle_band_hz[1] + 2 * BAND_MARGIN_HZ, models.wide.band_hz[1]
    high_response = predict_acceleration(forces, rate_hz, ModelledResponse(models.wide))
    return BandPredictions(
        edges_hz=(edges.low_hz or 0.0, edges.high_hz or 0.0),
        cut_error=compute_band_error(reference, cut_response, rate_hz, middle_band_hz),
        uncut_error=compute_band_error(reference, full_response, rate_hz, middle_band_hz),
        level_error=compute_level_error(reference, high_response, rate_hz, high_band_hz),
        direction=()
        if banded_forces.high is None
        else tuple(float(component) for component in banded_forces.high.direction),
        travel_m=0.0 if banded_forces.motion is None else banded_forces.motion.travel_m,
    )


def _describe_conditions(model: IdentifiedModel) -> str:
    """Describe the conditions of the identification, from the model's provenance."""
    hand_condition = "in a hand" if "held" in str(model.provenance.get("hand")) else "without a hand"
    spring_condition = "with" if model.provenance.get("input") == "excitation" else "without"
    return f"{hand_condition} and {spring_condition} the spring in it"
