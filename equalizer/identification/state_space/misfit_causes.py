"""Likely causes of a model's misfit, as sentences; where the evidence is insufficient, the sentences state that.

Evidence: the residual power over the noise power (`cost`), the residuals' correlation between neighbouring lines, poles
at the decay bound, the error on a test, and the levels of fit and test. All thresholds are heuristic.
"""

from collections.abc import Sequence

import numpy as np

from equalizer.identification.state_space.held_out_validation import HeldOutValidation
from equalizer.identification.state_space.misfit import Misfit
from equalizer.identification.state_space.relaxed_poles import SlowPole
from equalizer.identification.state_space.settings import IdentificationSettings
from equalizer.signals.recording import Recording

UNEXPLAINED = 1.5
"""Cost (residual power over noise power) above which residuals count as larger than the noise."""
SMOOTH = 0.5
"""Correlation of the residuals of neighbouring lines from which they count as a linear response that the model
lacks."""
HELD_OUT_BEYOND = 2.0
"""Held-out error, relative to the root sum of squares of its noise and the fit's misfit, above which a separate cause
is reported."""
LEVEL_RATIO = 1.25
"""Ratio of the largest amplitudes of test and fit segments above which their levels count as different."""
LIMIT_SAMPLES = 10
"""Number of neighbouring pairs at the same extreme value above which a sensor counts as saturated."""


def fit_remarks(
    cost: float, misfit: Misfit, relaxed: Sequence[SlowPole], bound_costs: bool, settings: IdentificationSettings
) -> list[str]:
    """Remarks on the fit alone, as sentences without full stop. Those on the decay bound come first, because its effect
    resembles the other causes. bound_costs: see `RelaxedFit`."""
    bound_s, order = settings.decay_s, settings.order
    remarks = [
        f"the resonance at {pole.frequency_hz:.2f} Hz (damping ratio {100 * pole.damping_ratio:.2g} %) rings longer "
        f"than the ordinary bound of {bound_s:g} s allows; its pole was relaxed to a decay of {pole.decay_s:.2f} s"
        for pole in relaxed
    ]
    if bound_costs:
        remarks.append(
            f"a pole is at the bound of the decay, {bound_s:g} s, and without it the fit would improve beyond noise: "
            "a resonance rings longer, or a sweep without two counted periods contains the transient of its start; "
            "record three periods of every sweep, or raise --longest-decay"
        )
    if cost > UNEXPLAINED and not bound_costs:
        residual = f"the residual of the model is {np.sqrt(cost):.2g} times the noise"
        if misfit.smooth is None:
            remarks.append(
                f"{residual}: the order {order} may be too low, or the device is not linear, as with friction; without "
                "two counted periods of every sweep the lines do not show which"
            )
        elif misfit.smooth >= SMOOTH:
            remarks.append(
                f"{residual}, and it varies smoothly from line to line, as that of a linear response does: the order "
                f"{order} may be too low; weak friction can do this too, and then a higher order does not help"
            )
        else:
            remarks.append(
                f"{residual}, and it scatters from line to line, as that of a linear response does not: a higher order "
                "does not help; the device is not linear (friction does this, clipping, a grip that moves), or it "
                "changed from one sweep to the next; the lines do not show which"
            )
    return remarks


def held_out_remarks(
    tested: HeldOutValidation | None, cost: float, misfit: Misfit, recordings: Sequence[Recording]
) -> tuple[str, ...]:
    """Remarks, as whole sentences, on clipped sensors and on a test error that neither noise nor the fit's misfit
    explains."""
    remarks = [
        f"The sensor is at its limit: {channel} stays at one extreme value."
        for channel in _find_clipped_channels(recordings)
    ]
    if tested is None:
        return tuple(remarks)
    expected = float(np.hypot(tested.noise or 0.0, misfit.error))
    if tested.noise is None or tested.error <= HELD_OUT_BEYOND * expected or cost > UNEXPLAINED:
        return tuple(remarks)
    fit, test = (_largest_amplitude(recordings, test=test) for test in (False, True))
    if min(fit, test) > 0 and max(fit, test) > LEVEL_RATIO * min(fit, test):
        remarks.append(
            "The error on the test is larger than that of the fit, and the test was played at another level (up to "
            f"{test:.3g} N, the fit {fit:.3g} N): the response may depend on the amplitude, as with friction."
        )
    else:
        remarks.append(
            "The error on the test is larger than the fit explains, at the same level: the device differed between "
            "the two, or its response depends on the kind of signal; these recordings do not show which."
        )
    return tuple(remarks)


def _largest_amplitude(recordings: Sequence[Recording], *, test: bool) -> float:
    """Largest stated amplitude of the segments with the role "test", or of all others; 0 without any."""
    amplitudes = [
        segment.amplitude
        for recording in recordings
        for segment in recording.segments
        if (segment.role == "test") is test
    ]
    return max(amplitudes, default=0.0)


def _find_clipped_channels(recordings: Sequence[Recording]) -> tuple[str, ...]:
    """Channels that repeatedly stay at the same largest or smallest value."""
    clipped: dict[str, None] = {}
    for recording in recordings:
        samples = recording.response.samples
        for column, channel in enumerate(recording.response.channels):
            values = samples[np.isfinite(samples[:, column]), column]
            for extreme in (values.max(initial=-np.inf), values.min(initial=np.inf)):
                is_extreme = values == extreme
                if (
                    np.sum(is_extreme[1:] & is_extreme[:-1]) >= LIMIT_SAMPLES
                    and np.ptp(values) > 0
                    and not is_extreme.all()
                ):
                    clipped[channel] = None
    return tuple(clipped)
