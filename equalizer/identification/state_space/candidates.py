"""Candidate state-space models: starting models, each refined to a local optimum, and the choice among them.

The cost as a function of poles and output shapes has many local minima. Two subspace methods therefore give starting
models without iteration, each for several horizons: frequency-domain identification on a warped frequency axis
(`warped_subspace`), and canonical variate analysis of time records (`canonical_variate`). Each start is refined by
maximum likelihood (`refinement`), first on lines averaged in bins, where the cost is smooth and cheap, then, in a
narrow band, on all lines. Equations and references are in these modules.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from equalizer.identification.state_space.canonical_variate import (
    choose_decimation_factor,
    collect_driven_records,
    estimate_observability,
    estimate_poles_and_shapes,
)
from equalizer.identification.state_space.modal_form import ModalForm
from equalizer.identification.state_space.refinement import FittedForm, complete_form, refine_form
from equalizer.identification.state_space.settings import IdentificationSettings
from equalizer.identification.state_space.stable_poles import Radius, compute_pole_radius
from equalizer.identification.state_space.warped_subspace import (
    choose_horizon,
    estimate_subspace,
    extract_poles_and_shapes,
)
from equalizer.identification.state_space.weighted_lines import (
    WeightedLines,
    average_bins,
    compute_bin_centres_hz,
    group_lines,
)
from equalizer.signals.recording import Recording
from equalizer.signals.signal import ComplexArray

LEAST_LINES_PER_BIN = 5
"""Least number of lines per bin for the first refinement in a narrow band. Heuristic."""
BIN_WIDTH_OCTAVES = 1 / 40
"""Width of a bin of a wide band, in octaves. Heuristic."""
LARGEST_OUTSIDE_GAIN = 100.0
"""Largest acceptable `Candidate.outside_gain`: a model above it fits the lines by cancellation of large modes.
Heuristic."""
GAIN_POINTS = 2000
"""Number of frequencies from 0 to half the sample rate over which `compute_outside_gain` takes the largest gain.
Chosen."""
MAX_BIN_STEPS, MAX_LINE_STEPS = (60, 20, 20), 4
"""Largest numbers of Levenberg-Marquardt steps: in each of three passes on averaged lines, and at the end on all lines
of a narrow band. Heuristic."""


@dataclass(frozen=True, slots=True, eq=False)
class StartingModel:
    """Starting model of a search: poles and output shapes, without B and D."""

    name: str
    """Subspace method and horizon, as text for the provenance of the model."""
    form: ModalForm


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """Refined model at the end of a search."""

    name: str
    fitted: FittedForm
    cost: float
    """Squared residual over noise variance, mean over all entries of all lines: about 1 where the residual is noise."""
    outside_gain: float
    """Largest gain at any frequency over the largest on the fitted lines, from `compute_outside_gain`."""
    radius: Radius
    """Largest magnitude of a discrete-time pole that the search allows: common, or (blocks,)."""

    @property
    def has_acceptable_gain(self) -> bool:
        """Whether `outside_gain` is at most `LARGEST_OUTSIDE_GAIN`."""
        return self.outside_gain <= LARGEST_OUTSIDE_GAIN


def estimate_subspace_starts(lines: WeightedLines, settings: IdentificationSettings) -> tuple[StartingModel, ...]:
    """Estimate starting models by frequency-domain subspace identification, one per entry of
    `settings.longer_horizons`. Raises numpy.linalg.LinAlgError where the order has more parameters than the lines
    determine."""
    return tuple(estimate_subspace_start(lines, settings, extra_rows) for extra_rows in settings.longer_horizons)


def estimate_subspace_start(lines: WeightedLines, settings: IdentificationSettings, extra_rows: int) -> StartingModel:
    """Estimate a starting model by frequency-domain subspace identification with a warped frequency axis. extra_rows:
    block rows beyond the shortest useful horizon."""
    radius = compute_pole_radius(settings.decay_s, lines.sample_rate_hz)
    horizon = choose_horizon(settings.order, lines.response.shape[1]) + extra_rows
    subspace = estimate_subspace(lines, horizon, settings.centre_hz)
    return StartingModel(
        f"warped subspace, horizon {horizon}", extract_poles_and_shapes(subspace, settings.order, radius)
    )


def estimate_record_starts(
    recordings: Sequence[Recording], lines: WeightedLines, settings: IdentificationSettings
) -> tuple[StartingModel, ...]:
    """Estimate starting models by canonical variate analysis of time records, one per horizon that has enough rows and
    samples; none where the band is too wide for decimation by 2 or more."""
    decimation_factor = choose_decimation_factor(lines.sample_rate_hz, settings.band_hz[1])
    if decimation_factor < 2:
        return ()
    records = collect_driven_records(recordings, decimation_factor)
    p, m = lines.response.shape[1:]
    radius = compute_pole_radius(settings.decay_s, lines.sample_rate_hz)
    starts = []
    for horizon in settings.record_horizons:
        observability = estimate_observability(records, m, horizon) if horizon * p > settings.order + p else None
        if observability is not None:
            form = estimate_poles_and_shapes(observability, p, settings.order, decimation_factor, radius)
            starts.append(StartingModel(f"canonical variates, horizon {horizon}", form))
    return tuple(starts)


def refine_start(start: StartingModel, lines: WeightedLines, settings: IdentificationSettings) -> Candidate:
    """Complete a starting model by B and D (linear least squares), and refine it as in `refine_candidate`."""
    radius = compute_pole_radius(settings.decay_s, lines.sample_rate_hz)
    return refine_candidate(start.name, complete_form(start.form, lines), lines, settings, radius)


def refine_candidate(
    name: str, fitted: FittedForm, lines: WeightedLines, settings: IdentificationSettings, radius: Radius
) -> Candidate:
    """Refine a model on bins, formed anew about the result of each pass, then on all lines if the band is narrow.
    radius: largest magnitude of a pole."""
    for steps in MAX_BIN_STEPS:
        fitted = refine_form(fitted.form, average_about_model(fitted, lines, settings), radius, steps)
    if not settings.wide:
        fitted = refine_form(fitted.form, lines, radius, MAX_LINE_STEPS)
    cost = lines.compute_cost(fitted.compute_response(lines.z)) / lines.response.size
    return Candidate(name, fitted, cost, compute_outside_gain(fitted, lines), radius)


def average_about_model(fitted: FittedForm, lines: WeightedLines, settings: IdentificationSettings) -> WeightedLines:
    """Average the lines in bins about a model. The difference from the model's response is averaged, which varies less
    within a bin than the response."""
    bins = group_lines(lines, 1, BIN_WIDTH_OCTAVES) if settings.wide else group_lines(lines, LEAST_LINES_PER_BIN, 0.0)
    centres = np.exp(2j * np.pi * compute_bin_centres_hz(lines, bins) / lines.sample_rate_hz)
    return average_bins(lines, bins, fitted.compute_response(lines.z), fitted.compute_response(centres))


def compute_outside_gain(fitted: FittedForm, lines: WeightedLines) -> float:
    """Compute the largest gain at `GAIN_POINTS` frequencies from 0 to half the sample rate over the largest on the
    lines. The gain is the largest singular value of the response matrix."""
    unit_circle = np.exp(1j * np.linspace(0, np.pi, GAIN_POINTS))
    return float(
        _find_largest_gain(fitted.compute_response(unit_circle)) / _find_largest_gain(fitted.compute_response(lines.z))
    )


def choose_best(candidates: Sequence[Candidate]) -> Candidate:
    """Choose the candidate of lowest cost among those with acceptable gain outside the band; if none is acceptable,
    that with the smallest gain outside the band. Raises ValueError for an empty sequence."""
    acceptable = [candidate for candidate in candidates if candidate.has_acceptable_gain]
    return (
        min(acceptable, key=lambda candidate: candidate.cost)
        if acceptable
        else min(candidates, key=lambda candidate: candidate.outside_gain)
    )


def _find_largest_gain(response: ComplexArray) -> float:
    """Find the largest singular value of a response (lines, outputs, inputs) over all lines."""
    return float(np.linalg.norm(response, ord=2, axis=(1, 2)).max())
