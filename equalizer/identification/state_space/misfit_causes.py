"""Likely causes of a model's misfit, as sentences; where the evidence is insufficient, the sentences state that.

Evidence: the residual power over the noise power (`cost`), the residuals' correlation between neighbouring lines, poles
at the decay bound, the error on a test, and the levels of fit and test. All thresholds are chosen.
"""

from collections.abc import Sequence

import numpy as np

from equalizer.identification.state_space.held_out_validation import HeldOutValidation
from equalizer.identification.state_space.misfit import Misfit
from equalizer.identification.state_space.relaxed_poles import SlowPole
from equalizer.identification.state_space.settings import IdentificationSettings
from equalizer.signals.recording import Recording

UNEXPLAINED_COST = 1.5
"""Cost (residual power over noise power) above which residuals count as larger than the noise."""
SMOOTH_CORRELATION = 0.5
"""Correlation of the residuals of neighbouring lines from which they count as a linear response that the model
lacks."""
HELD_OUT_RATIO = 2.0
"""Held-out error, relative to the root sum of squares of its noise and the fit's misfit, above which a separate cause
is reported."""
LEVEL_RATIO = 1.25
"""Ratio of the largest amplitudes of test and fit segments above which their levels count as different."""
CLIPPED_PAIRS = 10
"""Number of pairs of successive samples at the same extreme value from which a sensor counts as saturated."""


def describe_misfit_causes(
    cost: float,
    misfit: Misfit,
    relaxed_poles: Sequence[SlowPole],
    is_bound_binding: bool,
    settings: IdentificationSettings,
) -> list[str]:
    """Describe likely causes by the fit alone, as sentences without full stop. Those on the decay bound come first,
    because its effect resembles the other causes. cost: residual power over noise power. is_bound_binding: see
    `RelaxedFit`."""
    bound_s, order = settings.decay_s, settings.order
    remarks = [
        f"the resonance at {pole.frequency_hz:.2f} Hz (damping ratio {100 * pole.damping_ratio:.2g} %) rings longer "
        f"than the ordinary bound of {bound_s:g} s allows; its pole was relaxed to a decay of {pole.decay_s:.2f} s"
        for pole in relaxed_poles
    ]
    if is_bound_binding:
        remarks.append(
            f"a pole is at the bound of the decay, {bound_s:g} s, and without it the fit would improve beyond noise: "
            "a resonance rings longer, or a sweep without two counted periods contains the transient of its start; "
            "record three periods of every sweep, or raise --longest-decay"
        )
    if cost > UNEXPLAINED_COST and not is_bound_binding:
        residual_text = f"the residual of the model is {np.sqrt(cost):.2g} times the noise"
        if misfit.smooth is None:
            remarks.append(
                f"{residual_text}: the order {order} may be too low, or the device is not linear, as with friction; "
                "without two counted periods of every sweep the lines do not show which"
            )
        elif misfit.smooth >= SMOOTH_CORRELATION:
            remarks.append(
                f"{residual_text}, and it varies smoothly from line to line, as that of a linear response does: the "
                f"order {order} may be too low; weak friction can do this too, and then a higher order does not help"
            )
        else:
            remarks.append(
                f"{residual_text}, and it scatters from line to line, as that of a linear response does not: a "
                "higher order does not help; the device is not linear (friction does this, clipping, a grip that "
                "moves), or it changed from one sweep to the next; the lines do not show which"
            )
    return remarks


def describe_test_error_causes(
    validation: HeldOutValidation | None, cost: float, misfit: Misfit, recordings: Sequence[Recording]
) -> tuple[str, ...]:
    """Describe, in whole sentences, clipped sensors, and a test error that neither noise nor the fit's misfit
    explains. A test error is reported only where its noise is known and the fit's cost is at most `UNEXPLAINED_COST`.
    validation: None = without a test; recordings: those of the fit and of the test."""
    remarks = [
        f"The sensor is at its limit: {channel} stays at one extreme value."
        for channel in _find_clipped_channels(recordings)
    ]
    if validation is None:
        return tuple(remarks)
    expected_error = float(np.hypot(validation.noise or 0.0, misfit.error))
    if validation.noise is None or validation.error <= HELD_OUT_RATIO * expected_error or cost > UNEXPLAINED_COST:
        return tuple(remarks)
    fit_amplitude, test_amplitude = (_find_largest_amplitude(recordings, of_test=is_test) for is_test in (False, True))
    if min(fit_amplitude, test_amplitude) > 0 and max(fit_amplitude, test_amplitude) > LEVEL_RATIO * min(
        fit_amplitude, test_amplitude
    ):
        remarks.append(
            "The error on the test is larger than that of the fit, and the test was played at another level (up to "
            f"{test_amplitude:.3g}, the fit {fit_amplitude:.3g}, in the unit of the command): the response may depend "
            "on the amplitude, as with friction."
        )
    else:
        remarks.append(
            "The error on the test is larger than the fit explains, and no stated difference of levels accounts for "
            "it: the device differed between the two, or its response depends on the kind of signal; these recordings "
            "do not show which."
        )
    return tuple(remarks)


def _find_largest_amplitude(recordings: Sequence[Recording], *, of_test: bool) -> float:
    """Find the largest stated amplitude (unit of the command) of the segments with the role "test", or of all others; 0
    without any."""
    amplitudes = [
        segment.amplitude
        for recording in recordings
        for segment in recording.segments
        if (segment.role == "test") is of_test
    ]
    return max(amplitudes, default=0.0)


def _find_clipped_channels(recordings: Sequence[Recording]) -> tuple[str, ...]:
    """Find the response channels that stay at their largest or smallest value for `CLIPPED_PAIRS` or more pairs of
    successive samples in a recording; constant channels are not reported."""
    clipped_channels: dict[str, None] = {}
    for recording in recordings:
        samples = recording.response.samples
        for column, channel in enumerate(recording.response.channels):
            finite_samples = samples[np.isfinite(samples[:, column]), column]
            for extreme in (finite_samples.max(initial=-np.inf), finite_samples.min(initial=np.inf)):
                is_extreme = finite_samples == extreme
                if (
                    np.sum(is_extreme[1:] & is_extreme[:-1]) >= CLIPPED_PAIRS
                    and np.ptp(finite_samples) > 0
                    and not is_extreme.all()
                ):
                    clipped_channels[channel] = None
    return tuple(clipped_channels)
