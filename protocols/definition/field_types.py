"""Validation of values that occur in several tables of a protocol file: names, frequencies, force amplitudes.

Where no reason is stated, a bound is chosen.
"""

from typing import Annotated

from pydantic import AfterValidator, Field

from protocols.definition.problem import Problem, refuse

MAX_AMPLITUDE_N = 3.0
"""Highest force amplitude (N) that a protocol may set: the cap with a hand on the handle (docs/safety.md)."""


def _require_whole_tenths(frequency_hz: float) -> float:
    """Return the frequency (Hz) unchanged. Raises InconsistentError unless it is a multiple of 0.1 Hz, within 1e-10 Hz
    for rounding."""
    if abs(frequency_hz * 10 - round(frequency_hz * 10)) > 1e-9:
        allowed_text = "whole tenths of a hertz, so that whole periods can be looped"
        refuse([Problem("", f"is {frequency_hz} Hz", allowed_text)])
    return frequency_hz


Name = Annotated[
    str,
    Field(
        pattern=r"^[a-z][a-z0-9_]{0,63}$",
        description="Name of the protocol in files and logs: lower-case letters, digits and underscores.",
    ),
]
Title = Annotated[str, Field(min_length=1, max_length=200, description="Title of the protocol in reports and lists.")]
Source = Annotated[
    str,
    Field(max_length=1000, description="Source of the numbers. Default: empty, for numbers of your own choice."),
]
Frequency = Annotated[float, Field(ge=0.5, le=500.0)]
"""Frequency of a recording's excitation (Hz): up to the Nyquist frequency at a sample rate of 1 kHz."""
SineFrequency = Annotated[float, Field(ge=0.5, le=500.0), AfterValidator(_require_whole_tenths)]
"""Frequency of a recorded sinusoid (Hz), whose evaluated part holds whole periods."""
StimulusFrequency = Annotated[float, Field(ge=0.5, le=250.0), AfterValidator(_require_whole_tenths)]
"""Frequency of a trial's stimulus (Hz): up to 250 Hz, so that a period has at least four samples at 1 kHz."""
