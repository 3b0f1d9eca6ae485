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

from equalizer.identification.state_space.canonical_variate import canonical_variate, decimation_factor, driven_records
from equalizer.identification.state_space.canonical_variate import poles_and_shapes as from_records
from equalizer.identification.state_space.modal_form import ModalForm
from equalizer.identification.state_space.refinement import FittedForm, complete_form, refine
from equalizer.identification.state_space.settings import IdentificationSettings
from equalizer.identification.state_space.stable_poles import Radius, largest_radius
from equalizer.identification.state_space.warped_subspace import default_horizon, estimate_subspace, poles_and_shapes
from equalizer.identification.state_space.weighted_lines import (
    WeightedLines,
    average_bins,
    bin_centres_hz,
    group_lines,
)
from equalizer.signals.recording import Recording
from equalizer.signals.signal import ComplexArray

LINES_PER_BIN = 5
"""Least number of lines that are averaged to a bin for the first refinement, in a narrow band. Chosen by hand."""
OCTAVE_SHARE = 1 / 40
"""Width of a bin of a wide band, in octaves. Chosen by hand."""
LARGEST_GAIN = 100.0
"""Largest acceptable `outside_gain`: a model above it fits the lines by cancellation of large modes. Chosen by
hand."""
GAIN_POINTS = 2000
"""Number of frequencies from 0 to half the sample rate among which `outside_gain` takes the largest gain."""
MOST_STEPS, LAST_STEPS = (60, 20, 20), 4
"""Most steps of the refinement: in each pass on averaged lines, and at the end on all lines."""


@dataclass(frozen=True, slots=True, eq=False)
class Start:
    """Starting model of a search: poles and output shapes, without B and D."""

    name: str
    """Method and horizon, in words."""
    form: ModalForm


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """Refined model at the end of a search."""

    name: str
    fitted: FittedForm
    cost: float
    """Squared residual over noise variance, mean over all entries of all lines: about 1 where the residual is noise."""
    outside_gain: float
    """Largest gain at any frequency over the largest on the fitted lines, see `outside_gain`."""
    radius: Radius
    """Largest magnitude of a pole (discrete time) that the search allows."""

    @property
    def sane(self) -> bool:
        """Whether the gain outside the band is at most `LARGEST_GAIN` times that on the fitted lines."""
        return self.outside_gain <= LARGEST_GAIN


def subspace_starts(lines: WeightedLines, settings: IdentificationSettings) -> tuple[Start, ...]:
    """Starting models by frequency-domain subspace identification, for each number in `settings.longer_horizons`."""
    return tuple(subspace_start(lines, settings, extra_rows) for extra_rows in settings.longer_horizons)


def subspace_start(lines: WeightedLines, settings: IdentificationSettings, extra_rows: int) -> Start:
    """Starting model by frequency-domain subspace identification with a warped frequency axis. extra_rows: block rows
    beyond the shortest useful horizon."""
    radius = largest_radius(settings.decay_s, lines.sample_rate_hz)
    horizon = default_horizon(settings.order, lines.response.shape[1]) + extra_rows
    subspace = estimate_subspace(lines, horizon, settings.centre_hz)
    return Start(f"warped subspace, horizon {horizon}", poles_and_shapes(subspace, settings.order, radius))


def record_starts(
    recordings: Sequence[Recording], lines: WeightedLines, settings: IdentificationSettings
) -> tuple[Start, ...]:
    """Starting models by canonical variate analysis of time records, one per horizon that has enough rows and samples;
    none where the band is too wide for decimation."""
    factor = decimation_factor(lines.sample_rate_hz, settings.band_hz[1])
    if factor < 2:
        return ()
    records = driven_records(recordings, factor)
    p, m = lines.response.shape[1:]
    radius = largest_radius(settings.decay_s, lines.sample_rate_hz)
    starts = []
    for horizon in settings.record_horizons:
        observability = canonical_variate(records, m, horizon) if horizon * p > settings.order + p else None
        if observability is not None:
            form = from_records(observability, p, settings.order, factor, radius)
            starts.append(Start(f"canonical variates, horizon {horizon}", form))
    return tuple(starts)


def refine_start(start: Start, lines: WeightedLines, settings: IdentificationSettings) -> Candidate:
    """Candidate from a starting model: B and D by linear least squares, then refined as in `refine_candidate`."""
    radius = largest_radius(settings.decay_s, lines.sample_rate_hz)
    return refine_candidate(start.name, complete_form(start.form, lines), lines, settings, radius)


def refine_candidate(
    name: str, fitted: FittedForm, lines: WeightedLines, settings: IdentificationSettings, radius: Radius
) -> Candidate:
    """Refine a model on bins, formed anew about the result of each pass, then on all lines if the band is narrow.
    radius: largest magnitude of a pole."""
    for steps in MOST_STEPS:
        fitted = refine(fitted.form, bins_about(fitted, lines, settings), radius, steps)
    if not settings.wide:
        fitted = refine(fitted.form, lines, radius, LAST_STEPS)
    cost = lines.cost(fitted.response(lines.z)) / lines.response.size
    return Candidate(name, fitted, cost, outside_gain(fitted, lines), radius)


def bins_about(fitted: FittedForm, lines: WeightedLines, settings: IdentificationSettings) -> WeightedLines:
    """The lines averaged in bins. The difference from the model's response is averaged, which varies less within a bin
    than the response."""
    bins = group_lines(lines, 1, OCTAVE_SHARE) if settings.wide else group_lines(lines, LINES_PER_BIN, 0.0)
    centres = np.exp(2j * np.pi * bin_centres_hz(lines, bins) / lines.sample_rate_hz)
    return average_bins(lines, bins, fitted.response(lines.z), fitted.response(centres))


def outside_gain(fitted: FittedForm, lines: WeightedLines) -> float:
    """Largest gain at `GAIN_POINTS` frequencies from 0 to half the sample rate over the largest on the lines. The gain
    is the largest singular value of the response matrix."""
    circle = np.exp(1j * np.linspace(0, np.pi, GAIN_POINTS))
    return float(_largest_gain(fitted.response(circle)) / _largest_gain(fitted.response(lines.z)))


def choose_best(candidates: Sequence[Candidate]) -> Candidate:
    """The candidate of lowest cost among those with acceptable gain outside the band; if none is acceptable, the
    candidate with the smallest gain outside the band. Raises ValueError for an empty sequence."""
    sane = [candidate for candidate in candidates if candidate.sane]
    return (
        min(sane, key=lambda candidate: candidate.cost)
        if sane
        else min(candidates, key=lambda candidate: candidate.outside_gain)
    )


def _largest_gain(response: ComplexArray) -> float:
    """Largest singular value of a response (lines, outputs, inputs), over all lines."""
    return float(np.linalg.norm(response, ord=2, axis=(1, 2)).max())
