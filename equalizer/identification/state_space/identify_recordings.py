"""Identification from recordings: estimate and fit, repeated where long decays disturb the estimate, or where the lines
scatter more than their noise."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from equalizer.identification.frequency_response.experiments import periodic_experiments
from equalizer.identification.frequency_response.frequency_response import FrequencyResponse
from equalizer.identification.frequency_response.local_polynomial import smooth_response
from equalizer.identification.frequency_response.transfer_estimate import estimate_transfer
from equalizer.identification.state_space.identify import Identified, identify, outside_remark
from equalizer.identification.state_space.misfit import misfit_of_estimate
from equalizer.identification.state_space.misfit_causes import UNEXPLAINED, fit_remarks
from equalizer.identification.state_space.settings import IdentificationSettings
from equalizer.identification.state_space.settled_recordings import slow_part, subtract_free_decay
from equalizer.identification.state_space.stable_poles import largest_radius
from equalizer.plant.model_response import model_response
from equalizer.signals.recording import Recording

DISTURBING_DECAY_S = 1.0
"""Time constant above which the transient of a start disturbs the estimate, which leaves out its first 5 s."""
MOST_ROUNDS = 8
"""Most repetitions in which slow transients are subtracted and the model is refined."""
SETTLED = 1e-4
"""Relative change of the slowest decay between rounds below which no further round is made."""
SMOOTHED = (
    "The lines differ from the model by more than their noise: the fit was made to a local average over neighbouring "
    "lines (--no-smooth fits the lines themselves)."
)


@dataclass(frozen=True, slots=True, eq=False)
class IdentifiedRecordings:
    """Result of `identify_recordings`: frequency response of the recordings, and the state-space model fitted to it."""

    estimate: FrequencyResponse
    fitted: FrequencyResponse
    """The frequency response that the model was fitted to: the estimate, or its local averages."""
    identified: Identified


def identify_recordings(
    recordings: Recording | Sequence[Recording],
    settings: IdentificationSettings | None = None,
    smooth: bool | None = None,
    on_progress: Callable[[float], None] | None = None,
) -> IdentifiedRecordings:
    """Identify a state-space model of the recorded device, and state how well it fits.

    smooth: local averages over neighbouring lines, taken about the model where a pole was relaxed, because they would
    blunt its resonance; None: where the lines scatter more than their noise. `on_progress` takes the share done, 0 to
    1. Raises TransferEstimateError, IdentificationRefused.
    """
    recordings = (recordings,) if isinstance(recordings, Recording) else tuple(recordings)
    settings = settings or IdentificationSettings()
    estimate = estimate_transfer(recordings)
    looked_twice = _has_repeats(recordings)
    if not looked_twice:
        settings = replace(settings, longest_decay_s=settings.decay_s)
    found = _fit_estimate(estimate, recordings, settings, smooth, on_progress or (lambda _: None))
    if looked_twice and found.fitted is found.estimate:
        return found
    return _add_causes(found, settings, looked_twice)


def _fit_estimate(
    estimate: FrequencyResponse,
    recordings: tuple[Recording, ...],
    settings: IdentificationSettings,
    smooth: bool | None,
    report: Callable[[float], None],
) -> IdentifiedRecordings:
    if smooth and settings.longest_decay_s is not None:
        return _fit_smoothed(estimate, recordings, settings, None, report)
    identified = identify(estimate, settings, recordings, lambda share: report(share / 2))
    estimate, identified = _remove_transients(estimate, identified, recordings, settings)
    if smooth is False or (smooth is None and identified.cost <= UNEXPLAINED):
        report(1.0)
        return IdentifiedRecordings(estimate, estimate, identified)
    return _fit_smoothed(estimate, recordings, settings, identified, lambda share: report(0.5 + share / 2))


def _add_causes(
    found: IdentifiedRecordings, settings: IdentificationSettings, looked_twice: bool
) -> IdentifiedRecordings:
    """Add the causes of the misfit, judged on the lines themselves: residuals of local averages are always smooth,
    because neighbours share their lines."""
    identified, averaged = found.identified, found.fitted is not found.estimate
    misfit = misfit_of_estimate(identified.model, found.estimate) if averaged else identified.misfit
    misfit = misfit if looked_twice else replace(misfit, smooth=None)
    cost = misfit.cost if averaged else identified.cost
    causes = fit_remarks(cost, misfit, identified.relaxed, identified.bound_costs, settings)
    remarks = (*([SMOOTHED] if averaged else []), *causes, *outside_remark(identified.chosen))
    return replace(found, identified=replace(identified, misfit=misfit, remarks=remarks))


def _has_repeats(recordings: Sequence[Recording]) -> bool:
    """Whether every experiment has two counted periods.

    In a single period, or in windows, transient and leakage look like lightly damped resonances, so that poles are not
    relaxed on their evidence. Noise estimated from the scatter of the lines does not reveal the cause of a misfit
    either.
    """
    found = periodic_experiments(recordings)
    return bool(found.experiments) and all(experiment.periods > 1 for experiment in found.experiments)


def _remove_transients(
    estimate: FrequencyResponse,
    identified: Identified,
    recordings: Sequence[Recording],
    settings: IdentificationSettings,
) -> tuple[FrequencyResponse, Identified]:
    """Subtract the free decay of slow poles from the recordings, and identify again, until the decay settles."""
    radius, quick = largest_radius(DISTURBING_DECAY_S, estimate.sample_rate_hz), replace(settings, draws=0)
    rounds = 0
    while (slow := slow_part(identified, radius)) is not None and rounds < MOST_ROUNDS:
        before, rounds = identified.slowest_decay_s, rounds + 1
        estimate = estimate_transfer(subtract_free_decay(recordings, slow))
        identified = identify(estimate, quick, near=identified.chosen)
        if abs(identified.slowest_decay_s / before - 1) < SETTLED:
            break
    return estimate, identify(estimate, settings, near=identified.chosen) if rounds else identified


def _fit_smoothed(
    estimate: FrequencyResponse,
    recordings: tuple[Recording, ...],
    settings: IdentificationSettings,
    known: Identified | None,
    report: Callable[[float], None],
) -> IdentifiedRecordings:
    relaxed = known is not None and bool(known.relaxed)
    if known is not None and relaxed:
        fitted = smooth_response(estimate, about=model_response(known.model, estimate.frequency_hz))
        identified = identify(fitted, settings, near=known.chosen)
    else:
        fitted = smooth_response(estimate)
        # Averaged lines are correlated, so the likelihood-ratio test for a longer decay does not hold on them.
        held = replace(settings, longest_decay_s=settings.decay_s)
        identified = identify(fitted, held, recordings, report)
    report(1.0)
    # For the same reason the cost of the bound cannot be tested on averaged lines.
    bound_costs = known is not None and known.bound_costs
    return IdentifiedRecordings(estimate, fitted, replace(identified, bound_costs=bound_costs))
