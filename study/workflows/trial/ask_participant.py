"""Play one stimulus and get the participant's answer.

In a direction trial the stimulus is held until the answer, the number of a direction. In a detection
trial it is played in one of two intervals (two-interval forced choice, 2IFC), and the question follows.
"""

from dataclasses import dataclass

from protocols.trial import Phase, VoidCause
from study.devices.device import Fault, Health, Played
from study.session.facts.level_scale import equalizer_amplitude
from study.session.state.due_trial import Present
from study.session.state.state import SessionState
from study.session.stimulus.held_stimulus import HeldStimulus
from study.session.stimulus.stimulus import direction_vector, held_stimulus
from study.session.views.views import Answered, PlayingNotice, Question, Reply, Unanswered
from study.workflows.trial.sitting import Pulse, Sitting, release_device


@dataclass(frozen=True, slots=True, eq=False)
class StimulusReply:
    """The reply to one stimulus and the state of the device at that moment."""

    reply: Reply
    started_s: float
    """Time (s, by the session's clock) from which an answer was possible: the response time counts from here."""
    felt_whole: bool
    """Whether the device had no fault until the answer. A later fault, for example during a slow disk write, does not
    make the trial void."""
    played: Played | None
    """Result of a stimulus that was released before the question; None if it is still held or never began."""
    holding: bool
    """Whether the stimulus is still held and has to be released."""
    health: Health | None = None
    """Counters of the device at the answer; None if the question was not reached."""
    pulse: Pulse | None = None
    """Pulse on the trigger line at the onset of the force; None without such a line, or if the force did not begin."""


def ask_participant(state: SessionState, present: Present, question: Question, sitting: Sitting) -> StimulusReply:
    """Play the stimulus, ask the question, and return the reply. In a direction trial the stimulus is still held
    then."""
    sitting.supervisor.begin("trial")
    if present.phase is Phase.DETECTION:
        return _in_one_of_two_intervals(state, present, question, sitting)
    sitting.device.hold(_stimulus(state, present, sitting))
    # Read before the pulse is sent: the attempt to send a pulse may take time, which belongs to the response time.
    started_s = sitting.clock.now_s()
    pulse = sitting.pulse()
    sitting.hand.feel(present, state.answers)
    reply = _reply_to(question, sitting)
    sitting.device.keep_alive()
    health = sitting.device.health()
    whole = health.fault is Fault.NONE
    return StimulusReply(reply, started_s, whole, played=None, holding=True, health=health, pulse=pulse)


def _in_one_of_two_intervals(
    state: SessionState, present: Present, question: Question, sitting: Sitting
) -> StimulusReply:
    """Play the stimulus in interval 1 or 2 (`present.label`) and nothing in the other one, then ask for the
    interval."""
    played: Played | None = None
    pulse: Pulse | None = None
    sitting.hand.feel(present, state.answers)
    for interval in (1, 2):
        holding = interval == present.label
        if holding:
            sitting.device.hold(_stimulus(state, present, sitting))
            pulse = sitting.pulse()
        cut = _wait(f"Interval {interval}", interval, state.protocol.detection.interval_s, sitting)
        if cut is not None:
            return StimulusReply(cut, sitting.clock.now_s(), False, played, holding, pulse=pulse)
        if holding:
            played = release_device(sitting)
        cut = _wait("", 0, state.protocol.detection.gap_s, sitting) if interval == 1 else None
        if cut is not None:
            return StimulusReply(cut, sitting.clock.now_s(), False, played, holding=False, pulse=pulse)
    started_s = sitting.clock.now_s()
    reply = _reply_to(question, sitting)
    health = played.health if played is not None else None
    whole = health is not None and health.fault is Fault.NONE
    return StimulusReply(reply, started_s, whole, played, holding=False, health=health, pulse=pulse)


def _reply_to(question: Question, sitting: Sitting) -> Reply:
    """Reply to the question. A request to repeat the trial beyond the allowed number is ignored: the question is asked
    again."""
    while True:
        reply = sitting.supervisor.resolve(sitting.display.ask(question, sitting.supervisor.glance))
        repeat = isinstance(reply, Unanswered) and reply.asked and not (reply.pause or reply.leave)
        if not repeat or question.repeats_left != 0 or not sitting.supervisor.glance():
            return reply


def _wait(title: str, number: int, seconds: float, sitting: Sitting) -> Unanswered | None:
    """Wait `seconds` during an interval or gap. None when they have passed; else why the wait ended: a button pressed
    too early makes the trial void (`VoidCause.EARLY`)."""
    reply = sitting.display.show_playing(PlayingNotice(title, number, seconds, picture=None), sitting.supervisor.glance)
    if reply is None and sitting.supervisor.glance():
        return None
    resolved = sitting.supervisor.resolve(reply or Unanswered("the stimulus ended early", leave=False))
    return (
        Unanswered("answered before both intervals", leave=False, cause=VoidCause.EARLY)
        if isinstance(resolved, Answered)
        else resolved
    )


def _stimulus(state: SessionState, present: Present, sitting: Sitting) -> HeldStimulus:
    """The stimulus of a trial, with its level converted to the quantity of the equalizer (N or m/s²)."""
    return held_stimulus(
        state.protocol.stimulus,
        direction_vector(state.protocol.directions, present.direction),
        present.frequency_hz,
        present.polarity * equalizer_amplitude(state.opened.equalized, present.level_n, present.frequency_hz),
        sitting.equalizer,
        sitting.device.info.sample_rate_hz,
    )
