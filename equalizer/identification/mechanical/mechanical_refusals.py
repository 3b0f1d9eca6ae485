"""Checks that refuse a mechanical fit; each message states the cause and, where there is one, the remedy.

Before the fit: no recording, an inconsistent one, recordings that disagree in rate, hold, channels or units, responses
fewer than commands or of unsuitable quantities, too few samples, constant or empty channels. After it: a model that
explains no channel, or is unstable. Called by `mechanical_fit`.
"""

from collections.abc import Sequence

from equalizer.identification.mechanical.mechanical_fit_result import MechanicalFitError
from equalizer.identification.mechanical.mechanical_refinement import RefinedFit
from equalizer.identification.mechanical.mechanical_structure import Structure
from equalizer.identification.mechanical.modal_structure import ModalStructure
from equalizer.plant.mechanical_model import DERIVATIVE_OF_QUANTITY
from equalizer.signals.recording import Recording
from equalizer.signals.recording_checks import find_unusable_channels, format_channels, list_recording_problems
from equalizer.signals.signal import FloatArray

LEAST_SAMPLES = 64
"""Fewest samples of the longest recording. Chosen."""
LEAST_UNEXPLAINED_ERROR = 0.97
"""Relative rms simulation error above which a channel counts as not explained: less than 6 % (1 - 0.97²) of its power
is. Chosen."""


def refuse_unsuitable(recordings: Sequence[Recording]) -> None:
    """Check the recordings before a fit. Raises MechanicalFitError for any of the conditions before the fit in the
    module docstring."""
    if not recordings:
        raise MechanicalFitError("there is no recording to fit a model to; give at least one")
    if problems := list_recording_problems(recordings):
        raise MechanicalFitError("; ".join(problems))
    first_recording = recordings[0]
    for number, recording in enumerate(recordings[1:], start=2):
        for property_name, expected, actual in (
            ("sample rate", first_recording.sample_rate_hz, recording.sample_rate_hz),
            ("hold", first_recording.hold.value, recording.hold.value),
            ("command", format_channels(first_recording.command), format_channels(recording.command)),
            ("response", format_channels(first_recording.response), format_channels(recording.response)),
        ):
            if expected != actual:
                raise MechanicalFitError(
                    f"recording {number} has the {property_name} {actual}, the first {expected}; fit them separately"
                )
    quantities = set(first_recording.response.quantities)
    if len(quantities) > 1 or not quantities <= set(DERIVATIVE_OF_QUANTITY):
        raise MechanicalFitError(
            f"the responses are {', '.join(sorted(quantities))}, but a mechanical model answers one of "
            f"{', '.join(DERIVATIVE_OF_QUANTITY)} for all channels; keep the responses of one quantity (the map of an "
            "import can make the others helpers)"
        )
    inputs, outputs = len(first_recording.command.channels), len(first_recording.response.channels)
    if outputs < inputs:
        raise MechanicalFitError(
            f"{inputs} commands and {outputs} responses: the motion along every command must be recorded"
        )
    _refuse_samples(recordings)


def _refuse_samples(recordings: Sequence[Recording]) -> None:
    """Check the samples. Raises MechanicalFitError where all recordings are shorter than `LEAST_SAMPLES`, or a
    channel is constant or without values in all of them."""
    if (longest_count := max(len(recording) for recording in recordings)) < LEAST_SAMPLES:
        raise MechanicalFitError(
            f"{longest_count} samples are too short a recording; at least {LEAST_SAMPLES} are needed"
        )
    for side in ("command", "response"):
        for name, is_empty in find_unusable_channels([getattr(recording, side) for recording in recordings]):
            if is_empty:
                raise MechanicalFitError(
                    f"{side} {name} contains only missing values; leave it out, or import it again"
                )
            raise MechanicalFitError(
                f"{side} {name} is constant throughout, so nothing can be inferred from it; "
                "leave it out, or record it driven"
            )


def refuse_noise(relative_error: FloatArray, channels: tuple[str, ...]) -> None:
    """Check that a fit explains a channel. relative_error: (p + 1,), rms error of the simulation relative to the rms of
    the response, by channel and, last, over all. Raises MechanicalFitError where each of the p channels exceeds
    `LEAST_UNEXPLAINED_ERROR`. channels: names, for the message."""
    if relative_error[:-1].min() > LEAST_UNEXPLAINED_ERROR:
        raise MechanicalFitError(
            f"the commands do not predict {', '.join(channels)}: a fitted model has an error of "
            f"{relative_error[:-1].min():.0%} of the signal in the best channel; the recording is noise, or its "
            "commands and responses are not of the same device"
        )


def refuse_unstable(refined_fit: RefinedFit[Structure] | RefinedFit[ModalStructure]) -> None:
    """Check that a fit is stable. Raises MechanicalFitError for a pole whose real part (1/s) exceeds a thousandth
    (chosen) of the speed scale, which allows for rounding of poles at zero."""
    from equalizer.identification.mechanical.mechanical_response import compute_pole_form

    pole_form = compute_pole_form(refined_fit.structure.build_model(refined_fit.unknowns))
    largest_growth_rate = float(pole_form.poles.real.max())
    if largest_growth_rate > 1e-3 * refined_fit.structure.speed_scale:
        raise MechanicalFitError(
            f"the best fit is unstable (it grows e-fold in {1 / largest_growth_rate:.3g} s): look for a feedback in "
            "the command that was not recorded, or a polarity that changes"
        )
