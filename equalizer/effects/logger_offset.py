"""A logger that started at another time than the commands: the response comes late or early, the position does not."""

from equalizer.effects.effect import Effect, OnResponse, Parameter, Values
from equalizer.effects.evidence import Evidence
from equalizer.effects.other_times import read_other_times
from equalizer.effects.response_starts import lateness
from equalizer.signals.signal import FloatArray

LONGEST_S = 1.0
LEAST_SAMPLES = 1e-3


def _read(response: FloatArray, sample_rate_hz: float, channels: tuple[int, ...], of: Values) -> FloatArray:
    return read_other_times(response, 1.0, -of["offset"] * sample_rate_hz)


def _starts(evidence: Evidence, channel: int) -> tuple[Values, ...]:
    if channel > 0:
        return ()
    weight = evidence.used[:, None] / evidence.noise
    longest = min(int(LONGEST_S * evidence.sample_rate_hz), len(weight) // 2)
    late = lateness(evidence.response * weight, evidence.predicted * weight, longest)
    return ({"offset": late / evidence.sample_rate_hz},) if abs(late) > LEAST_SAMPLES else ()


EFFECT = Effect(
    name="logger_offset",
    equation="y(t) = x(t - offset)",
    source="Oppenheim and Schafer, Discrete-Time Signal Processing, ch. 4: a delay by part of a sample",
    signature="the response's phase is off in proportion to frequency, at every level alike, while the position agrees",
    parameters=(Parameter("offset", -LONGEST_S, LONGEST_S, none=0.0, scale="linear", step=1e-5),),
    acts=OnResponse(_read, stage=4, shared=True),
    starts=_starts,
    sites=("all",),
)
