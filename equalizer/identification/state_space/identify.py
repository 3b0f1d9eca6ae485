"""Identification of a state-space model from measured frequency responses: starts, refinement, choice, uncertainty.

Theory of operation. The measured response G(f) of each line f has noise of known variance s(f)² per entry. The model

    G_M(f) = C (zI - A)^-1 B + D,    z = exp(2 pi i f / rate)

minimises the weighted squared residual sum of |G - G_M|² / s², the maximum-likelihood estimate for Gaussian noise.

1. Starts. Subspace identification in the frequency domain (`warped_subspace`) for several horizons, and canonical
   variate analysis of the time records (`canonical_variate`), because the cost has many local minima.
2. Refinement. Each start is refined by Levenberg-Marquardt steps over poles and output shapes (`refinement`). All
   poles stay inside a circle that stands for the longest decay the recordings can show: the model is always stable.
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
from equalizer.identification.state_space.bootstrap import parameter_draws, scatter_of_draws
from equalizer.identification.state_space.candidates import (
    Candidate,
    Start,
    bins_about,
    choose_best,
    record_starts,
    refine_start,
    subspace_start,
    subspace_starts,
)
from equalizer.identification.state_space.misfit import Misfit, count_unknowns, misfit_of
from equalizer.identification.state_space.misfit_causes import UNEXPLAINED, fit_remarks
from equalizer.identification.state_space.refusals import IdentificationRefused, require_lines
from equalizer.identification.state_space.relaxed_poles import RelaxedFit, SlowPole, relax_poles, retighten, slow_poles
from equalizer.identification.state_space.settings import IdentificationSettings
from equalizer.identification.state_space.weighted_lines import WeightedLines
from equalizer.plant.identified_model import IdentifiedModel
from equalizer.signals.recording import Recording
from equalizer.signals.summary import Summarised, Summary

FIRST_SEARCH = 0.8
"""Share of the progress that is reported for the first search; poles are relaxed in the rest."""
SAMPLED_BEFORE_WRITTEN = 1.0
"""Delay of one sample: a response is read just before its row's command is written."""


@dataclass(frozen=True, repr=False, slots=True, eq=False)
class Identified(Summarised):
    """A model and how well it fits what was measured."""

    model: IdentifiedModel
    cost: float
    """Reduced chi-squared: squared residual over noise variance, per degree of freedom."""
    rms_relative_error: float
    """Rms error of the model against the estimate over the band, the estimate's noise included."""
    worst_relative_error: float
    """Error of the worst line, relative to the root mean square of the response."""
    scatter: float | None
    """Error of the model that the noise causes, from the bootstrap draws: root mean square over the lines, relative to
    the response; None without draws. Lack of fit is not included."""
    misfit: Misfit
    """Lack of fit: difference of the lines from the model beyond their noise."""
    expected_error: float | None
    """95 % bound of the total error, likewise relative: noise, and the most misfit that the noise may hide."""
    lines: int
    candidates: tuple[Candidate, ...]
    chosen: Candidate
    relaxed: tuple[SlowPole, ...]
    """Poles with a longer decay than the ordinary bound, which the data require; slowest first."""
    bound_costs: bool
    """Whether the decay bound that was asked for prevents a fit of the data."""
    remarks: tuple[str, ...]
    """Remarks for the user, as sentences; `misfit_causes` has likely causes of a misfit."""

    @property
    def slowest_decay_s(self) -> float:
        """Time constant in seconds."""
        radius = self.model.spectral_radius
        return float(-1 / (np.log(radius) * self.model.sample_rate_hz)) if radius > 0 else 0.0

    def summary(self) -> Summary:
        expected = "not known" if self.expected_error is None else f"{100 * self.expected_error:.3g} % (95 %)"
        return Summary(
            "Identified device",
            (
                *self.model.summary().rows,
                ("expected error", expected),
                ("cost per unknown (noise alone: 1)", f"{self.cost:.3g}"),
                *(("remark", remark) for remark in self.remarks),
            ),
        )


def identify(
    response: FrequencyResponse | Sequence[FrequencyResponse],
    settings: IdentificationSettings | None = None,
    records: tuple[Recording, ...] = (),
    on_progress: Callable[[float], None] | None = None,
    initial: Candidate | None = None,
) -> Identified:
    """Fit one model to all estimates together, each line weighted by its noise. The model is always stable.

    `records` give further starts in the time domain. `on_progress` takes the share done, 0 to 1. `initial`: a model to
    refine on these lines instead of a search; poles that were relaxed for it are bounded again where that costs
    nothing. Raises IdentificationRefused where no model can be fitted to the data.
    """
    settings = settings or IdentificationSettings()
    report = on_progress or (lambda _: None)
    responses = (response,) if isinstance(response, FrequencyResponse) else tuple(response)
    lines = require_lines(responses, settings)
    _refuse_foreign(records, responses[0])

    if initial is not None:
        refit = RelaxedFit(retighten(initial, lines, settings), bound_costs=False)
        return _assess_model((refit.candidate,), refit, lines, responses[0], settings)
    candidates = _search(lines, settings, records, lambda share: report(FIRST_SEARCH * share))
    relaxed_fit = relax_poles(
        choose_best(candidates),
        lambda relaxed_settings: _search(lines, relaxed_settings, records, lambda _: None),
        lines,
        settings,
    )
    all_candidates = candidates if relaxed_fit.candidate in candidates else [*candidates, relaxed_fit.candidate]
    identified = _assess_model(tuple(all_candidates), relaxed_fit, lines, responses[0], settings)
    report(1.0)
    return identified


def _search(
    lines: WeightedLines,
    settings: IdentificationSettings,
    records: tuple[Recording, ...],
    report: Callable[[float], None],
) -> list[Candidate]:
    starts = _make_starts(lines, settings, records)
    candidates = []
    for number, start in enumerate(starts):
        report(number / len(starts))
        candidates.append(refine_start(start, lines, settings))
    candidates += _spare_candidates(choose_best(candidates), lines, settings)
    report(1.0)
    return candidates


def _make_starts(
    lines: WeightedLines, settings: IdentificationSettings, records: tuple[Recording, ...]
) -> tuple[Start, ...]:
    try:
        return (*subspace_starts(lines, settings), *record_starts(records, lines, settings))
    except np.linalg.LinAlgError as problem:
        order = settings.order
        raise IdentificationRefused(
            f"order {order} has more parameters than the {len(lines)} lines in the band can determine; choose a lower "
            f"order, such as {max(order // 4 * 2, 2)}"
        ) from problem


def _spare_candidates(
    best_so_far: Candidate, lines: WeightedLines, settings: IdentificationSettings
) -> list[Candidate]:
    """Further candidates of a wide band, until one leaves no more than noise."""
    candidates: list[Candidate] = []
    for extra_rows in settings.spare_horizons if settings.wide else ():
        if choose_best([best_so_far, *candidates]).cost <= UNEXPLAINED:
            break
        candidates.append(refine_start(subspace_start(lines, settings, extra_rows), lines, settings))
    return candidates


def _assess_model(
    candidates: tuple[Candidate, ...],
    relaxed_fit: RelaxedFit,
    lines: WeightedLines,
    response: FrequencyResponse,
    settings: IdentificationSettings,
) -> Identified:
    chosen = relaxed_fit.candidate
    low, high = settings.band_hz
    p, m = lines.response.shape[1:]
    unknowns = count_unknowns(settings.order, p, m)
    cost = chosen.cost * lines.response.size / max(lines.response.size - unknowns / 2, 1.0)
    in_band = (lines.frequency_hz >= low) & (lines.frequency_hz <= high)
    modelled = chosen.fitted.response(lines.z)
    error = lines.relative_error(modelled)[in_band]
    slow = () if settings.longest_decay_s else slow_poles(chosen, settings.decay_s, lines.sample_rate_hz)
    misfit = misfit_of(lines, modelled, in_band, unknowns)
    model = _make_model(chosen, lines, cost, response, settings, slow)
    return Identified(
        model=model,
        cost=cost,
        rms_relative_error=float(np.sqrt((error**2).mean())),
        worst_relative_error=float(error.max()),
        scatter=(scatter := scatter_of_draws(model, lines.frequency_hz[in_band], slow)),
        misfit=misfit,
        expected_error=None if scatter is None else float(np.hypot(scatter, misfit.upper_bound)),
        lines=int(in_band.sum()),
        candidates=candidates,
        chosen=chosen,
        relaxed=slow,
        bound_costs=relaxed_fit.bound_costs,
        remarks=(*fit_remarks(cost, misfit, slow, relaxed_fit.bound_costs, settings), *outside_remark(chosen)),
    )


def _refuse_foreign(records: tuple[Recording, ...], response: FrequencyResponse) -> None:
    for record in records:
        form = (record.sample_rate_hz, record.command.channels, record.response.channels)
        if form != (response.sample_rate_hz, response.input_channels, response.output_channels):
            raise IdentificationRefused(
                f"a record of {', '.join(form[2])} per {', '.join(form[1])} at {form[0]:g} Hz does not belong to a "
                f"response of {', '.join(response.output_channels)} per {', '.join(response.input_channels)} at "
                f"{response.sample_rate_hz:g} Hz; give the records that the response was estimated from"
            )


def outside_remark(chosen: Candidate) -> list[str]:
    """Remark on a large gain outside the band; empty where the gain is acceptable."""
    if chosen.sane:
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
    slow: tuple[SlowPole, ...],
) -> IdentifiedModel:
    fitted = chosen.fitted
    samples = None
    if settings.draws:
        noise_factor = float(np.sqrt(max(cost, 1.0)))
        bins = bins_about(fitted, lines, settings)
        samples = parameter_draws(fitted, bins, chosen.radius, noise_factor, settings.draws, settings.seed)
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
        delay_samples=SAMPLED_BEFORE_WRITTEN,
        samples=samples,
        provenance={
            "method": "subspace identification, refined by maximum likelihood on the lines of the response",
            "start": chosen.name,
            "residual_over_noise": float(np.sqrt(cost)),
            "longest_decay_s": settings.decay_s,
            "relaxed_poles": [[pole.frequency_hz, pole.decay_s] for pole in slow],
        },
    )
