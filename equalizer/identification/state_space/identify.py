"""Identification of a state-space model from measured frequency responses: starts, refinement, choice, uncertainty.

Theory of operation. The measured response G(f) of each line f has noise of known variance s(f)² per entry. The model

    G_M(f) = C (zI - A)^-1 B + D,    z = exp(2 pi i f / rate)

minimises the weighted squared residual sum of |G - G_M|² / s², the maximum-likelihood estimate for Gaussian noise.

1. Starts. Subspace identification in the frequency domain (`warped_subspace`) for several horizons, and canonical
   variate analysis of the time records (`canonical_variate`), because the cost has many local minima.
2. Refinement. Each start is refined by Levenberg-Marquardt steps over poles and output shapes (`refinement`). All
   poles stay inside a circle that stands for the longest decay allowed: the model is always stable.
3. Choice. Least cost among those without a large gain outside the band (`candidates`).
4. Relaxation. Where the bound on the decay costs significantly, single poles may decay more slowly (`relaxed_poles`).
5. Uncertainty. A parametric bootstrap refits draws of the noise (`bootstrap`); the misfit is what exceeds the noise.

References: McKelvey, Akçay and Ljung, IEEE Trans. Autom. Control 41:960 (1996); Pintelon and Schoukens, System
Identification (2012), chapters 2 and 9.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from equalizer.identification.frequency_response.frequency_response import FrequencyResponse
from equalizer.identification.state_space.bootstrap import compute_relative_deviation, draw_bootstrap_parameters
from equalizer.identification.state_space.candidates import (
    Candidate,
    StartingModel,
    average_about_model,
    choose_best,
    estimate_record_starts,
    estimate_subspace_start,
    estimate_subspace_starts,
    refine_start,
)
from equalizer.identification.state_space.misfit import Misfit, compute_misfit, count_unknowns
from equalizer.identification.state_space.misfit_causes import UNEXPLAINED_COST, describe_misfit_causes
from equalizer.identification.state_space.refusals import IdentificationError, require_lines
from equalizer.identification.state_space.relaxed_poles import (
    RelaxedFit,
    SlowPole,
    list_slow_poles,
    refine_and_tighten,
    relax_poles,
)
from equalizer.identification.state_space.settings import IdentificationSettings
from equalizer.identification.state_space.weighted_lines import WeightedLines
from equalizer.plant.identified_model import IdentifiedModel
from equalizer.signals.recording import Recording
from equalizer.signals.summary import Summary, SummaryDisplay

FIRST_SEARCH_PROGRESS = 0.8
"""Fraction of the reported progress that the first search takes; the relaxation of poles takes the rest. Chosen."""
DELAY_SAMPLES = 1.0
"""Delay of the response to a command, samples: each response is sampled just before the command of the same row is
written."""


@dataclass(frozen=True, repr=False, slots=True, eq=False)
class IdentificationResult(SummaryDisplay):
    """An identified model with its goodness of fit."""

    model: IdentifiedModel
    cost: float
    """Reduced chi-squared: squared residual over noise variance, per degree of freedom."""
    rms_relative_error: float
    """Rms error of the model against the estimate over the band, the estimate's noise included."""
    worst_relative_error: float
    """Error of the worst line in the band, relative to the root mean square of the response."""
    scatter: float | None
    """Error of the model that the noise causes, from the bootstrap draws: root mean square over the lines, relative to
    the response; None without draws. Lack of fit is not included."""
    misfit: Misfit
    """Lack of fit: difference of the lines from the model beyond their noise."""
    lines: int
    """Number of lines within the band, without its margins."""
    candidates: tuple[Candidate, ...]
    """All refined models of the first search, and the chosen one; with `initial`, the chosen one alone."""
    chosen: Candidate
    relaxed: tuple[SlowPole, ...]
    """Poles with a longer decay than the ordinary bound, which the data require; slowest first."""
    is_bound_binding: bool
    """Whether the requested bound on the decay prevents a fit of the data."""
    remarks: tuple[str, ...]
    """Remarks for the user, as sentences; `misfit_causes` has likely causes of a misfit."""

    @property
    def expected_error(self) -> float | None:
        """95 % bound of the total error, relative to the response: `scatter`, and the upper bound of the misfit; None
        without draws or without that bound."""
        if self.scatter is None or self.misfit.upper_bound is None:
            return None
        return float(np.hypot(self.scatter, self.misfit.upper_bound))

    @property
    def slowest_decay_s(self) -> float:
        """Longest time constant (s) of a pole; 0 where all poles are zero."""
        radius = self.model.spectral_radius
        return float(-1 / (np.log(radius) * self.model.sample_rate_hz)) if radius > 0 else 0.0

    def summary(self) -> Summary:
        """Rows for display: those of the model, expected error, cost and remarks."""
        expected = "not known" if self.expected_error is None else f"{100 * self.expected_error:.3g} % (95 %)"
        return Summary(
            "Identified device",
            (
                *self.model.summary().rows,
                ("expected error", expected),
                ("cost per degree of freedom (noise alone: 1)", f"{self.cost:.3g}"),
                *(("remark", remark) for remark in self.remarks),
            ),
        )


def identify(
    response: FrequencyResponse | Sequence[FrequencyResponse],
    settings: IdentificationSettings | None = None,
    records: tuple[Recording, ...] = (),
    on_progress: Callable[[float], None] | None = None,
    initial: Candidate | None = None,
) -> IdentificationResult:
    """Fit one model to all estimates together, each line weighted by its noise. The model is always stable.

    `records` give further starts in the time domain. `initial`: a model to refine on these lines instead of a search;
    poles that were relaxed for it are bounded again where that costs nothing. `on_progress` takes the share done, 0 to
    1, of a search; it is not called with `initial`. Raises IdentificationError where no model can be fitted to the
    data.
    """
    settings = settings or IdentificationSettings()
    report_progress = on_progress or (lambda _: None)
    responses = (response,) if isinstance(response, FrequencyResponse) else tuple(response)
    lines = require_lines(responses, settings)
    _refuse_mismatched_records(records, responses[0])

    if initial is not None:
        refit = RelaxedFit(refine_and_tighten(initial, lines, settings), is_bound_binding=False)
        return _assess_model((refit.candidate,), refit, lines, responses[0], settings)
    candidates = _search(lines, settings, records, lambda share: report_progress(FIRST_SEARCH_PROGRESS * share))
    relaxed_fit = relax_poles(
        choose_best(candidates),
        lambda relaxed_settings: _search(lines, relaxed_settings, records, lambda _: None),
        lines,
        settings,
    )
    all_candidates = candidates if relaxed_fit.candidate in candidates else [*candidates, relaxed_fit.candidate]
    identified = _assess_model(tuple(all_candidates), relaxed_fit, lines, responses[0], settings)
    report_progress(1.0)
    return identified


def _search(
    lines: WeightedLines,
    settings: IdentificationSettings,
    records: tuple[Recording, ...],
    report_progress: Callable[[float], None],
) -> list[Candidate]:
    """Refine all starting models. report_progress: takes the share done, 0 to 1. Raises IdentificationError as
    `_make_starts` does."""
    starts = _make_starts(lines, settings, records)
    candidates = []
    for start_index, start in enumerate(starts):
        report_progress(start_index / len(starts))
        candidates.append(refine_start(start, lines, settings))
    candidates += _refine_spare_starts(choose_best(candidates), lines, settings)
    report_progress(1.0)
    return candidates


def _make_starts(
    lines: WeightedLines, settings: IdentificationSettings, records: tuple[Recording, ...]
) -> tuple[StartingModel, ...]:
    """Make starting models from the lines and from the time records. Raises IdentificationError for an order with
    more parameters than the lines determine."""
    try:
        return (*estimate_subspace_starts(lines, settings), *estimate_record_starts(records, lines, settings))
    except np.linalg.LinAlgError as problem:
        order = settings.order
        raise IdentificationError(
            f"order {order} has more parameters than the {len(lines)} lines in the band can determine; choose a lower "
            f"order, such as {max(order // 4 * 2, 2)}"
        ) from problem


def _refine_spare_starts(
    best_so_far: Candidate, lines: WeightedLines, settings: IdentificationSettings
) -> list[Candidate]:
    """Refine further starting models of a wide band, one per entry of `spare_horizons`, until the best model's cost is
    at most `UNEXPLAINED_COST`."""
    candidates: list[Candidate] = []
    for extra_rows in settings.spare_horizons if settings.wide else ():
        if choose_best([best_so_far, *candidates]).cost <= UNEXPLAINED_COST:
            break
        candidates.append(refine_start(estimate_subspace_start(lines, settings, extra_rows), lines, settings))
    return candidates


def _assess_model(
    candidates: tuple[Candidate, ...],
    relaxed_fit: RelaxedFit,
    lines: WeightedLines,
    response: FrequencyResponse,
    settings: IdentificationSettings,
) -> IdentificationResult:
    """Assess the fitted model: cost, errors in the band, misfit, scatter of the bootstrap draws, and remarks."""
    chosen = relaxed_fit.candidate
    low_hz, high_hz = settings.band_hz
    p, m = lines.response.shape[1:]
    unknowns = count_unknowns(settings.order, p, m)
    cost = chosen.cost * lines.response.size / max(lines.response.size - unknowns / 2, 1.0)
    is_in_band = (lines.frequency_hz >= low_hz) & (lines.frequency_hz <= high_hz)
    modelled_response = chosen.fitted.compute_response(lines.z)
    relative_error = lines.compute_relative_error(modelled_response)[is_in_band]
    relaxed_poles = () if settings.longest_decay_s else list_slow_poles(chosen, settings.decay_s, lines.sample_rate_hz)
    misfit = compute_misfit(lines, modelled_response, is_in_band, unknowns)
    model = _make_model(chosen, lines, cost, response, settings, relaxed_poles)
    return IdentificationResult(
        model=model,
        cost=cost,
        rms_relative_error=float(np.sqrt((relative_error**2).mean())),
        worst_relative_error=float(relative_error.max()),
        scatter=compute_relative_deviation(model, lines.frequency_hz[is_in_band], relaxed_poles),
        misfit=misfit,
        lines=int(is_in_band.sum()),
        candidates=candidates,
        chosen=chosen,
        relaxed=relaxed_poles,
        is_bound_binding=relaxed_fit.is_bound_binding,
        remarks=(
            *describe_misfit_causes(cost, misfit, relaxed_poles, relaxed_fit.is_bound_binding, settings),
            *write_outside_gain_remark(chosen),
        ),
    )


def _refuse_mismatched_records(records: tuple[Recording, ...], response: FrequencyResponse) -> None:
    """Raise IdentificationError for a record whose sample rate or channels differ from those of the response."""
    for record in records:
        record_format = (record.sample_rate_hz, record.command.channels, record.response.channels)
        if record_format != (response.sample_rate_hz, response.input_channels, response.output_channels):
            raise IdentificationError(
                f"a record of {', '.join(record_format[2])} per {', '.join(record_format[1])} at {record_format[0]:g}"
                f" Hz does not belong to a response of {', '.join(response.output_channels)} per "
                f"{', '.join(response.input_channels)} at "
                f"{response.sample_rate_hz:g} Hz; give the records that the response was estimated from"
            )


def write_outside_gain_remark(chosen: Candidate) -> list[str]:
    """Write a remark on a large gain outside the band; empty where the gain is acceptable."""
    if chosen.has_acceptable_gain:
        return []
    return [
        f"outside the band the model's gain is {chosen.outside_gain:.0f} times that inside: "
        f"keep what is played within the band, or lower the order"
    ]


def _make_model(
    chosen: Candidate,
    lines: WeightedLines,
    cost: float,
    response: FrequencyResponse,
    settings: IdentificationSettings,
    relaxed_poles: tuple[SlowPole, ...],
) -> IdentifiedModel:
    """Make the model to store, with bootstrap draws of its parameters (if requested) and its provenance."""
    fitted = chosen.fitted
    samples = None
    if settings.draws:
        noise_factor = float(np.sqrt(max(cost, 1.0)))
        bins = average_about_model(fitted, lines, settings)
        samples = draw_bootstrap_parameters(fitted, bins, chosen.radius, noise_factor, settings.draws, settings.seed)
    return IdentifiedModel(
        A=fitted.form.state_matrix,
        B=fitted.B,
        C=fitted.form.C,
        D=fitted.D,
        sample_rate_hz=response.sample_rate_hz,
        band_hz=settings.band_hz,
        input_unit=response.input_unit,
        output_unit=response.output_unit,
        input_channels=response.input_channels,
        output_channels=response.output_channels,
        delay_samples=DELAY_SAMPLES,
        samples=samples,
        provenance={
            "method": "subspace identification, refined by maximum likelihood on the lines of the response",
            "start": chosen.name,
            "residual_over_noise": float(np.sqrt(cost)),
            "longest_decay_s": settings.decay_s,
            "relaxed_poles": [[pole.frequency_hz, pole.decay_s] for pole in relaxed_poles],
        },
    )
