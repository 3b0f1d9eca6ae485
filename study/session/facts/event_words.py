"""Describe the log of a session in words: a line per event, and lines with the dates (`describe_log`).

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
from study.session.views.count_text import format_count
from study.session.views.local_time import Zone, split_time_in_zone, to_utc

_PresentationKey = tuple[int, int, int]
"""Run, trial and attempt of a presentation."""
PROBE_PHRASES = {
    "hand": "Probe with the hand on the handle",
    "free": "Test whether the handle is free",
    "reference": "Reference without a hand",
}
"""Beginning of the sentence about a probe, by its kind."""


def describe_log(events: Iterable[Event], zone: Zone = to_utc) -> tuple[str, ...]:
    """Describe each event in a line, in the order of the log: time in `zone`, or its text where it is no time, and
    sentences. A line with the date precedes the first event with a time, and each change of date or UTC offset."""
    events = tuple(events)
    measured_keys = {_get_presentation_key(event) for event in events if isinstance(event, TrialMeasured)}
    presentations = {
        _get_presentation_key(presentation): presentation
        for presentation in events
        if isinstance(presentation, TrialPresented) and _get_presentation_key(presentation) in measured_keys
    }
    lines: list[str] = []
    last_date_line = ""
    for event in events:
        date, time, utc_offset = split_time_in_zone(event.utc, zone)
        date_line = f"{date} (times are UTC {utc_offset})" if utc_offset else ""
        if date_line and date_line != last_date_line:
            last_date_line = date_line
            lines.append(date_line)
        lines.append(f"{time or date}  {_describe_in_context(event, presentations)}")
    return tuple(lines)


def _describe_in_context(event: Event, presentations: dict[_PresentationKey, TrialPresented]) -> str:
    """Describe an event in sentences. presentations: those of trials that count, by run, trial and attempt."""
    match event:
        case TrialPresented():
            return _describe_presented(event, with_direction=_get_presentation_key(event) in presentations)
        case AnswerGiven():
            return _describe_answer(event, presentations.get(_get_presentation_key(event)))
        case TrialMeasured():
            return _describe_measured(event)
        case TrialSpoiled():
            return f"{_name_trial(event)} is void and is presented again: {_join_lines(event.reason)}."
        case RestTaken():
            return f"Rested {_format_seconds(event.rested_s)} before trial {event.trial + 1} of run {event.run + 1}."
        case _:
            return _describe_outside_trials(event)


def _describe_outside_trials(event: Event) -> str:
    """Describe an event outside the trials."""
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
    """Describe an event that accompanies the trials: onset pulse, masking noise, or probe."""
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


def _describe_probe(event: ProbePlayed | ProbeMeasured) -> str:
    """Describe that a probe was played, or whether its recording was kept."""
    if isinstance(event, ProbePlayed):
        return f"{PROBE_PHRASES[event.kind]}, number {event.number + 1}: {event.level_n:.3g} N."
    recording_text = "kept" if event.recording else "not kept"
    reason = f": {_join_lines(event.trouble)}" if event.trouble else ""
    return f"The probe, number {event.number + 1}, was {recording_text}{reason}."


def _describe_sitting(event: SessionOpened | SessionResumed | SessionInterrupted | SessionClosed) -> str:
    """Describe the beginning or end of a session or sitting."""
    match event:
        case SessionOpened():
            person_text = f"simulated participant {event.observer}" if event.observer else "a person"
            return (
                f"Session {event.session} began: {event.subject}, {person_text}, on {_describe_device(event.device)}."
            )
        case SessionResumed():
            mended_text = " An incomplete last line, left by a crash, was removed." if event.mended else ""
            return f"The session was continued, on {_describe_device(event.device)}.{mended_text}"
        case SessionInterrupted():
            # Whether the session can be resumed, later events decide: its line in a list tells that.
            return f"The sitting ended: {_join_lines(event.reason)}."
        case SessionClosed():
            if event.outcome != "completed":
                return f"The session is over: {INELIGIBILITY_REASONS[event.outcome]}. The person does not take part."
            return "The session is finished."


def _describe_presented(event: TrialPresented, with_direction: bool) -> str:
    """Describe the stimulus of a trial; with_direction: also the right answer."""
    attempt_text = f", attempt {event.attempt + 1}" if event.attempt else ""
    stimulus_text = f"{event.level_n:.3f} N at {event.frequency_hz:g} Hz"
    if with_direction:
        target = f"interval {event.direction}" if event.phase is Phase.DETECTION else f"direction {event.direction}"
        stimulus_text = f"{target}, {stimulus_text}"
    return f"{_name_trial(event)} ({event.phase.value}{attempt_text}): {stimulus_text}."


def _describe_answer(event: AnswerGiven, presentation: TrialPresented | None) -> str:
    """Describe the answer, and whether it was right; the latter only if the presentation is given."""
    text = f"Answer {event.answer} after {event.response_time_s:.2f} s"
    if presentation is None:
        return f"{text}."
    return f"{text}: {'right' if event.answer == presentation.direction else 'wrong'}."


def _describe_measured(event: TrialMeasured) -> str:
    """Describe the delivered acceleration of a trial that counts, and its flags."""
    if event.status == "unmeasured":
        return " ".join(("Counts, without a measurement.", *map(_make_sentence, event.flags)))
    acceleration_texts = []
    if event.delivered_mps2 is not None:
        acceleration_texts.append(f"{event.delivered_mps2:.2f} m/s² along the direction")
    if event.off_axis_mps2 is not None:
        acceleration_texts.append(f"{event.off_axis_mps2:.2f} m/s² across")
    delivered_text = f"Delivered {', '.join(acceleration_texts)}." if acceleration_texts else "Counts."
    return " ".join((delivered_text, *map(_make_sentence, event.flags)))


def _describe_form(event: FormFilled) -> str:
    """Describe the outcome of a form, without the answers to questions about the participant."""
    version_text = f", version {event.version}" if event.version else ""
    ethics_text = f" (ethics approval {event.ethics_id})" if event.ethics_id else ""
    match event.form:
        case "consent":
            return f"Consent was {'given' if event.passed else 'not given'}{version_text}{ethics_text}."
        case "exclusion":
            outcome = "nothing speaks against taking part" if event.passed else "the sitting cannot go on"
            return f"The exclusion questions were answered{version_text}: {outcome}."
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
            question_count = format_count(len(event.answers), "question")
            return f"Before the trials: {question_count} answered; the answers stay in the log file."
        case "debrief":
            question_count = format_count(len(event.answers), "question")
            return f"Debrief: {question_count} answered; the answers stay in the log file."


def _describe_device(device: DeviceFacts) -> str:
    """Describe a device by its name, and whether it is simulated."""
    return f"{device.name}{' (simulated, nothing moves)' if device.simulated else ''}"


def _name_trial(event: TrialPresented | TrialSpoiled) -> str:
    """Name run and trial, counted from 1."""
    return f"Run {event.run + 1}, trial {event.trial + 1}"


def _get_presentation_key(event: TrialPresented | AnswerGiven | TrialMeasured) -> _PresentationKey:
    """Get run, trial and attempt of an event."""
    return event.run, event.trial, event.attempt


def _format_seconds(seconds: float) -> str:
    """Format a duration below 2 minutes in seconds, otherwise in whole minutes."""
    if seconds < 120:
        return f"{seconds:.3g} s"
    return f"{seconds / 60:.0f} min"


def _join_lines(text: str) -> str:
    """Replace line breaks, other unprintable characters and repeated blanks by single blanks."""
    return " ".join("".join(character if character.isprintable() else " " for character in text).split())


def _make_sentence(text: str) -> str:
    """Format a flag or finding as a sentence with capital and full stop; empty for an empty text."""
    line = _join_lines(text)
    return f"{line[:1].upper()}{line[1:]}{'' if line.endswith(('.', '!', '?')) else '.'}" if line else ""
