"""Problems for which a protocol file is refused for new sessions and recordings: fades shorter than half a tick, and
stimuli that the longest hold would always end.

Sessions with such protocols may exist. Therefore these checks are not part of the validation in `study_protocol` and
`recording_protocol`, with which a log is read, but of the reading of files (`study.store.formats.participant_texts`).
"""

from protocols.definition.probes import PROBE_HOLD_S
from protocols.definition.problem import Problem
from protocols.definition.recording_protocol import RecordingProtocol
from protocols.definition.study_protocol import StudyProtocol

NOMINAL_RATE_HZ = 1000.0
"""Rate of a device's control loop for which stimuli are made (Hz)."""


def find_new_use_problems(protocol: StudyProtocol | RecordingProtocol) -> tuple[Problem, ...]:
    """Find the problems of a protocol for new sessions or recordings; empty where there is none."""
    if isinstance(protocol, RecordingProtocol):
        return _find_short_fades({"fade_s": protocol.fade_s})
    stimulus = protocol.stimulus
    return (
        *_find_short_fades({"stimulus.fade_in_s": stimulus.fade_in_s, "stimulus.fade_out_s": stimulus.fade_out_s}),
        *_find_unfinished_stimuli(protocol),
    )


def _find_short_fades(fades_s: dict[str, float]) -> tuple[Problem, ...]:
    """Find fades (s), by their keys, that are rounded to no tick: the force would jump, and a slew limit derived from
    such a fade would limit nothing."""
    allowed = f"above {0.5 / NOMINAL_RATE_HZ:g} s, half a tick at {NOMINAL_RATE_HZ:g} Hz"
    return tuple(
        Problem(key, f"is {fade_s:g} s, no more than half a tick: the force would jump", allowed)
        for key, fade_s in fades_s.items()
        if round(fade_s * NOMINAL_RATE_HZ) == 0
    )


def _find_unfinished_stimuli(protocol: StudyProtocol) -> tuple[Problem, ...]:
    """Find stimuli of a fixed duration, and a fade-in, that the safety layer would end before they are complete."""
    durations_s = {"stimulus.fade_in_s": protocol.stimulus.fade_in_s}
    if protocol.detection.frequencies_hz:
        durations_s["detection.interval_s"] = protocol.detection.interval_s
    if protocol.demo.level_n:
        durations_s["demo.seconds"] = protocol.demo.seconds
    if protocol.probes.is_enabled:
        durations_s["the duration of a probe (probes.levels_n)"] = PROBE_HOLD_S
    longest_trial_s = protocol.safety.longest_trial_s
    return tuple(
        Problem(
            "safety.longest_trial_s",
            f"is {longest_trial_s:g} s, and {name} is {duration_s:g} s: each such stimulus would be released too early",
            f"above {duration_s:g} s",
        )
        for name, duration_s in durations_s.items()
        if duration_s >= longest_trial_s
    )
