"""The log of a session in words: one plain sentence per fact.

Answers to questions about health are left out. The direction of a trial that does not count (yet) is left out, too: the
trial may be repeated, and the participant may see the text. Runs and trials count from 1 here, as on the screen of the
participant.
"""

from collections.abc import Iterable

from protocols.trial import Phase
from study.session.facts.events import (
    AnswerGiven,
    DemoFinished,
    DemoPlayed,
    DeviceChecked,
    DeviceFacts,
    Event,
    FormFilled,
    MaskingPlayed,
    NoteTaken,
    OnsetPulsed,
    PauseTaken,
    PlaceTaken,
    ProbeMeasured,
    ProbePlayed,
    RestTaken,
    SessionClosed,
    SessionInterrupted,
    SessionOpened,
    SessionResumed,
    TrialMeasured,
    TrialPresented,
    TrialSpoiled,
)
from study.session.views.archive_views import INELIGIBILITY_REASONS
from study.session.views.local_time import Zone, split_time_in_zone, to_utc

_Key = tuple[int, int, int]
"""Run, trial and attempt of a presentation."""


def describe_log(events: Iterable[Event], zone: Zone = to_utc) -> tuple[str, ...]:
    """One line per event, oldest first: local time and a sentence. A line with the date precedes each change of date or
    UTC offset."""
    events = tuple(events)
    measured_keys = {_key(event) for event in events if isinstance(event, TrialMeasured)}
    presented = {_key(e): e for e in events if isinstance(e, TrialPresented) and _key(e) in measured_keys}
    lines: list[str] = []
    text = ""
    for event in events:
        date, time, offset = split_time_in_zone(event.utc, zone)
        day = f"{date} (times are UTC {offset})" if offset else ""
        if day and day != text:
            text = day
            lines.append(day)
        lines.append(f"{time or date}  {_describe(event, presented)}")
    return tuple(lines)


def describe_event(event: Event) -> str:
    """One event alone. Direction and correctness of a trial, which depend on other events, are left out."""
    return _describe(event, {})


def _describe(event: Event, presented: dict[_Key, TrialPresented]) -> str:
    """The sentence for an event. presented: the presentations of trials that count."""
    match event:
        case TrialPresented():
            return _describe_presented(event, with_direction=_key(event) in presented)
        case AnswerGiven():
            return _describe_answer(event, presented.get(_key(event)))
        case TrialMeasured():
            return _describe_measured(event)
        case TrialSpoiled():
            return f"{_describe_trial_place(event)} is void and is presented again: {event.reason}."
        case RestTaken():
            return f"Rested {_format_seconds(event.rested_s)} before trial {event.trial + 1} of run {event.run + 1}."
        case _:
            return _describe_other(event)


def _describe_other(event: Event) -> str:
    """The sentence for an event outside the trials."""
    match event:
        case SessionOpened() | SessionResumed() | SessionInterrupted() | SessionClosed():
            return _describe_sitting(event)
        case FormFilled():
            return _describe_form(event)
        case PlaceTaken():
            return f"Takes part, as number {event.participant_number + 1} of this protocol."
        case DeviceChecked():
            findings = " ".join(_make_sentence(finding) for finding in event.findings)
            return f"The device was checked: {'fine' if event.passed else 'not fine'}. {findings}".rstrip()
        case DemoPlayed():
            return (
                f"Demonstration: direction {event.direction} at {event.frequency_hz:g} Hz, {event.level_n:.3g} N, "
                f"for {_format_seconds(event.seconds)}."
            )
        case DemoFinished():
            return "The demonstration is over."
        case PauseTaken():
            return f"A pause of {_format_seconds(event.paused_s)}, asked for by the {event.who}."
        case OnsetPulsed() | MaskingPlayed() | ProbePlayed() | ProbeMeasured():
            return _describe_accompanying(event)
        case NoteTaken():
            return f"{'Adverse event' if event.adverse else 'Note'} by the {event.who}: {_join_lines(event.text)}"
        case _:
            return f"{event.event.replace('_', ' ').capitalize()}."


def _describe_accompanying(event: OnsetPulsed | MaskingPlayed | ProbePlayed | ProbeMeasured) -> str:
    """The sentence for an event that accompanies the trials: onset pulse, masking noise, or probe."""
    if isinstance(event, ProbePlayed | ProbeMeasured):
        return _describe_probe(event)
    if isinstance(event, OnsetPulsed):
        outcome = "was sent" if event.pulsed_s is not None else f"was lost: {_join_lines(event.trouble)}"
        return f"Onset pulse, {_join_lines(event.line)}: {outcome}."
    if event.trouble:
        return f"The masking noise fell silent: {_make_sentence(event.trouble)}"
    if not event.playing:
        return "The masking noise was stopped."
    band = f"{event.low_hz:g} to {event.high_hz:g} Hz"
    return f"Masking noise on {_join_lines(event.output)}: {event.level_db:g} dB, {band}, seed {event.seed}."


PROBES = {
    "hand": "Probe with the hand on the handle",
    "free": "Test whether the handle is free",
    "reference": "Reference without a hand",
}
"""Beginning of the sentence about a probe, by its kind."""


def _describe_probe(event: ProbePlayed | ProbeMeasured) -> str:
    if isinstance(event, ProbePlayed):
        return f"{PROBES[event.kind]}, number {event.number + 1}: {event.level_n:.3g} N."
    recording_text = "kept" if event.recording else "not kept"
    reason = f": {_join_lines(event.trouble)}" if event.trouble else ""
    return f"The probe, number {event.number + 1}, was {recording_text}{reason}."


def _describe_sitting(event: SessionOpened | SessionResumed | SessionInterrupted | SessionClosed) -> str:
    match event:
        case SessionOpened():
            participant = f"simulated participant {event.observer}" if event.observer else "a person"
            return (
                f"Session {event.session} began: {event.subject}, {participant}, on {_describe_device(event.device)}."
            )
        case SessionResumed():
            mended = " An incomplete last line, left by a crash, was removed." if event.mended else ""
            return f"The session was continued, on {_describe_device(event.device)}.{mended}"
        case SessionInterrupted():
            return f"The sitting ended: {event.reason}. The session can be resumed."
        case SessionClosed():
            if event.outcome != "completed":
                return f"The session is over: {INELIGIBILITY_REASONS[event.outcome]}. The person does not take part."
            return "The session is finished."


def _describe_presented(event: TrialPresented, with_direction: bool) -> str:
    attempt_text = f", attempt {event.attempt + 1}" if event.attempt else ""
    stimulus_text = f"{event.level_n:.3f} N at {event.frequency_hz:g} Hz"
    if with_direction:
        target = f"interval {event.direction}" if event.phase is Phase.DETECTION else f"direction {event.direction}"
        stimulus_text = f"{target}, {stimulus_text}"
    return f"{_describe_trial_place(event)} ({event.phase.value}{attempt_text}): {stimulus_text}."


def _describe_answer(event: AnswerGiven, presented: TrialPresented | None) -> str:
    """The answer, and whether it was right; the latter only if `presented` is given."""
    text = f"Answer {event.answer} after {event.response_time_s:.2f} s"
    if presented is None:
        return f"{text}."
    return f"{text}: {'right' if event.answer == presented.direction else 'wrong'}."


def _describe_measured(event: TrialMeasured) -> str:
    """The delivered acceleration of a trial that counts, and its flags."""
    if event.status == "unmeasured":
        return " ".join(("Counts, without a measurement.", *map(_make_sentence, event.flags)))
    parts = []
    if event.delivered_mps2 is not None:
        parts.append(f"{event.delivered_mps2:.2f} m/s² along the direction")
    if event.off_axis_mps2 is not None:
        parts.append(f"{event.off_axis_mps2:.2f} m/s² across")
    measured = f"Delivered {', '.join(parts)}." if parts else "Counts."
    return " ".join((measured, *map(_make_sentence, event.flags)))


def _describe_form(event: FormFilled) -> str:
    """The outcome of a form, without the answers to questions about the participant."""
    version = f", version {event.version}" if event.version else ""
    ethics = f" (ethics approval {event.ethics_id})" if event.ethics_id else ""
    match event.form:
        case "consent":
            return f"Consent was {'given' if event.passed else 'not given'}{version}{ethics}."
        case "exclusion":
            outcome = "nothing speaks against taking part" if event.passed else "the sitting cannot go on"
            return f"The exclusion questions were answered{version}: {outcome}."
        case "setup":
            answers_text = "; ".join(
                f"{key.replace('_', ' ')}: {_join_lines(answer)}" for key, answer in event.answers.items()
            )
            return (
                f"Set-up. {answers_text[:1].upper()}{answers_text[1:]}."
                if answers_text
                else "The questions on the set-up were asked."
            )
        case "questionnaire":
            question_count = _format_count(len(event.answers), "question")
            return f"Before the trials: {question_count} answered; the answers stay in the log file."
        case "debrief":
            return (
                f"Debrief: {_format_count(len(event.answers), 'question')} answered; the answers stay in the log file."
            )


def _describe_device(device: DeviceFacts) -> str:
    return f"{device.name}{' (simulated, nothing moves)' if device.simulated else ''}"


def _describe_trial_place(event: TrialPresented | TrialSpoiled) -> str:
    return f"Run {event.run + 1}, trial {event.trial + 1}"


def _key(event: TrialPresented | AnswerGiven | TrialMeasured) -> _Key:
    return event.run, event.trial, event.attempt


def _format_seconds(seconds: float) -> str:
    if seconds < 120:
        return f"{seconds:.3g} s"
    return f"{seconds / 60:.0f} min"


def _format_count(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"


def _join_lines(text: str) -> str:
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())


def _make_sentence(text: str) -> str:
    """A flag or finding as a sentence with capital and full stop."""
    line = _join_lines(text)
    return f"{line[:1].upper()}{line[1:]}{'' if line.endswith(('.', '!', '?')) else '.'}" if line else ""
