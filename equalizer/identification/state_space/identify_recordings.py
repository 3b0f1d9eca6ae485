"""Identification of a state-space model from recordings: estimate of the frequency response, fit, and repetitions.

The free decay of relaxed poles disturbs the estimate: it is subtracted from the recordings, and estimate and fit are
repeated. Where the lines scatter more than their noise, the fit is repeated on local averages.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from equalizer.identification.frequency_response.experiments import collect_periodic_experiments
from equalizer.identification.frequency_response.frequency_response import FrequencyResponse
from equalizer.identification.frequency_response.local_polynomial import smooth_response
from equalizer.identification.frequency_response.transfer_estimate import check_compatible, estimate_transfer
from equalizer.identification.state_space.free_decay import extract_slow_modes, subtract_free_decay
from equalizer.identification.state_space.identify import IdentificationResult, identify, write_outside_gain_remark
from equalizer.identification.state_space.misfit import compute_estimate_misfit
from equalizer.identification.state_space.misfit_causes import UNEXPLAINED_COST, describe_misfit_causes
from equalizer.identification.state_space.relaxed_poles import list_slow_poles
from equalizer.identification.state_space.settings import ORDINARY_DECAY_S, IdentificationSettings
from equalizer.identification.state_space.stable_poles import compute_pole_radius
from equalizer.plant.model_response import compute_model_response
from equalizer.signals.isolated_samples import interpolate_all
from equalizer.signals.recording import Recording
from equalizer.signals.summary import Summary, SummaryDisplay

DISTURBING_DECAY_S = 1.0
"""Time constant (s) above which the transient at the start of an excitation disturbs the estimate. Chosen: a transient
is taken to last 5 s (`experiments.TRANSIENT_S`), and after five time constants less than 1 % remains."""
MAX_ROUNDS = 8
"""Largest number of repetitions in which slow transients are subtracted and the model is refined. Chosen."""
SETTLED_DECAY_CHANGE = 1e-4
"""Relative change of the slowest decay between rounds below which no further round is made. Chosen."""
SMOOTHED_REMARK = (
    "The model was fitted to local averages over neighbouring lines, as is done by default where the lines differ from "
    "a model by more than their noise (--no-smooth fits the lines themselves)."
)
"""Remark of a model that was fitted to local averages."""


@dataclass(frozen=True, repr=False, slots=True, eq=False)
class RecordingsIdentification(SummaryDisplay):
    """Frequency response of recordings, and the state-space model fitted to it."""

    estimate: FrequencyResponse
    """Frequency response of the recordings, free decays of relaxed poles subtracted."""
    fitted: FrequencyResponse
    """The frequency response that the model was fitted to: the estimate, or its local averages."""
    identified: IdentificationResult

    def summary(self) -> Summary:
        """Rows of `identified`, for display."""
        return self.identified.summary()


def identify_recordings(
    recordings: Recording | Sequence[Recording],
    settings: IdentificationSettings | None = None,
    smooth: bool | None = None,
    on_progress: Callable[[float], None] | None = None,
) -> RecordingsIdentification:
    """Identify a state-space model of the recorded device, and state how well it fits. Isolated samples that no motion
    can have are interpolated before, with a remark.

    smooth: whether to fit local averages over neighbouring lines, taken about the model where a pole decays more slowly
    than the ordinary bound, because they would blunt its resonance; None: where the lines scatter more than their
    noise. `on_progress` takes the share done, 0 to 1. Raises TransferEstimateError as `estimate_transfer` does,
    IdentificationError as `identify` does, and ValueError where there are too few lines for local averages.
    """
    recordings = (recordings,) if isinstance(recordings, Recording) else tuple(recordings)
    check_compatible(recordings)
    recordings, interpolation_remarks = interpolate_all(recordings)
    settings = settings or IdentificationSettings()
    estimate = estimate_transfer(recordings)
    has_repeats = _has_repeats(recordings)
    if not has_repeats:
        settings = replace(settings, longest_decay_s=settings.decay_s)
    result = _fit_estimate(estimate, recordings, settings, smooth, on_progress or (lambda _: None))
    if not has_repeats or result.fitted is not result.estimate:
        result = _add_misfit_causes(result, settings, has_repeats)
    remarks = (*interpolation_remarks, *result.identified.remarks)
    return replace(result, identified=replace(result.identified, remarks=remarks))


def _fit_estimate(
    estimate: FrequencyResponse,
    recordings: tuple[Recording, ...],
    settings: IdentificationSettings,
    smooth: bool | None,
    report_progress: Callable[[float], None],
) -> RecordingsIdentification:
    """Fit the lines of the estimate, then, depending on `smooth`, local averages of them; the averages alone where
    `smooth` is true and the bound of the decay is fixed at the ordinary one or below, because no pole then decays more
    slowly. report_progress: takes the share done."""
    if smooth and settings.longest_decay_s is not None and settings.longest_decay_s <= ORDINARY_DECAY_S:
        return _fit_smoothed(estimate, recordings, settings, None, report_progress)
    identified = identify(estimate, settings, recordings, lambda share: report_progress(share / 2))
    estimate, identified = _remove_transients(estimate, identified, recordings, settings)
    if smooth is False or (smooth is None and identified.cost <= UNEXPLAINED_COST):
        report_progress(1.0)
        return RecordingsIdentification(estimate, estimate, identified)
    return _fit_smoothed(estimate, recordings, settings, identified, lambda share: report_progress(0.5 + share / 2))


def _add_misfit_causes(
    result: RecordingsIdentification, settings: IdentificationSettings, has_repeats: bool
) -> RecordingsIdentification:
    """Add the causes of the misfit, judged on the lines themselves: residuals of local averages are always smooth,
    because neighbours share their lines."""
    identified, is_averaged = result.identified, result.fitted is not result.estimate
    misfit = compute_estimate_misfit(identified.model, result.estimate) if is_averaged else identified.misfit
    misfit = misfit if has_repeats else replace(misfit, smooth=None, upper_bound=None)
    cost = misfit.cost if is_averaged else identified.cost
    causes = describe_misfit_causes(cost, misfit, identified.relaxed, identified.is_bound_binding, settings)
    remarks = (*([SMOOTHED_REMARK] if is_averaged else []), *causes, *write_outside_gain_remark(identified.chosen))
    return replace(result, identified=replace(identified, misfit=misfit, remarks=remarks))


def _has_repeats(recordings: Sequence[Recording]) -> bool:
    """Whether there is a periodic experiment, and every one has at least two counted periods.

    In a single period, or in windows, transient and leakage look like lightly damped resonances, so that poles are not
    relaxed on their evidence. A model fits them as closely as a resonance, so that no bound of its error is known.
    Noise estimated from the scatter of the lines does not reveal the cause of a misfit either.
    """
    experiment_set = collect_periodic_experiments(recordings)
    return bool(experiment_set.experiments) and all(experiment.periods > 1 for experiment in experiment_set.experiments)


def _remove_transients(
    estimate: FrequencyResponse,
    identified: IdentificationResult,
    recordings: Sequence[Recording],
    settings: IdentificationSettings,
) -> tuple[FrequencyResponse, IdentificationResult]:
    """Subtract the free decay of slow poles from the recordings, and identify again, until the slowest decay changes by
    less than `SETTLED_DECAY_CHANGE`, or `MAX_ROUNDS` are done."""
    radius, settings_without_draws = (
        compute_pole_radius(DISTURBING_DECAY_S, estimate.sample_rate_hz),
        replace(settings, draws=0),
    )
    rounds = 0
    while (slow_modes := extract_slow_modes(identified, radius)) is not None and rounds < MAX_ROUNDS:
        previous_decay_s, rounds = identified.slowest_decay_s, rounds + 1
        estimate = estimate_transfer(subtract_free_decay(recordings, slow_modes))
        identified = identify(estimate, settings_without_draws, initial=identified.chosen)
        if abs(identified.slowest_decay_s / previous_decay_s - 1) < SETTLED_DECAY_CHANGE:
            break
    return estimate, identify(estimate, settings, initial=identified.chosen) if rounds else identified


def _fit_smoothed(
    estimate: FrequencyResponse,
    recordings: tuple[Recording, ...],
    settings: IdentificationSettings,
    unsmoothed: IdentificationResult | None,
    report_progress: Callable[[float], None],
) -> RecordingsIdentification:
    """Fit local averages of the lines. unsmoothed: the fit of the lines themselves, whose chosen model is refined where
    a pole decays more slowly than the ordinary bound; None, or no such pole: a new search. report_progress: takes the
    share done."""
    # A bound that is fixed by hand relaxes no pole, but permits slow ones.
    if unsmoothed is not None and list_slow_poles(unsmoothed.chosen, ORDINARY_DECAY_S, estimate.sample_rate_hz):
        fitted = smooth_response(estimate, baseline=compute_model_response(unsmoothed.model, estimate.frequency_hz))
        identified = identify(fitted, settings, initial=unsmoothed.chosen)
    else:
        fitted = smooth_response(estimate)
        # Averaged lines are correlated, so the likelihood-ratio test for a longer decay does not hold on them.
        bounded_settings = replace(settings, longest_decay_s=settings.decay_s)
        identified = identify(fitted, bounded_settings, recordings, report_progress)
    report_progress(1.0)
    # For the same reason the cost of the bound cannot be tested on averaged lines.
    is_bound_binding = unsmoothed is not None and unsmoothed.is_bound_binding
    return RecordingsIdentification(estimate, fitted, replace(identified, is_bound_binding=is_bound_binding))
