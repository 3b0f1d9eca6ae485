"""Play one stimulus and get the participant's answer.

In a direction trial the stimulus is held until the answer, the number of a direction. In a detection trial it is played
in one of two intervals (two-interval forced choice, 2IFC), and the question follows.
"""

from dataclasses import dataclass

from protocols.trial import Phase, VoidCause
from study.devices.device import Fault, Health, PlaybackResult
from study.session.facts.level_scale import convert_level_to_amplitude
from study.session.state.due_trial import PresentTrial
from study.session.state.state import SessionState
from study.session.stimulus.held_stimulus import HeldStimulus
from study.session.stimulus.stimulus import compute_direction_vector, make_held_stimulus
from study.session.views.participant_views import Answered, PlayingNotice, Question, Reply, Unanswered
from study.workflows.trial.sitting import Pulse, Sitting, release_device


@dataclass(frozen=True, slots=True, eq=False)
class StimulusReply:
    """The reply to one stimulus and the state of the device at that moment."""

    reply: Reply
    """Answer, or why there is none."""
    started_s: float
    """Time (s, by the session's clock) from which an answer was possible: the response time counts from here."""
    is_complete: bool
    """Whether the device had no fault until the answer (of a detection trial: until the release); False if the question
    was not reached. A later fault, for example during a slow disk write, does not make the trial void."""
    play_result: PlaybackResult | None
    """Result of a stimulus that was released before the question; None if it is still held or never began."""
    holding: bool
    """Whether the stimulus is still held and has to be released."""
    health: Health | None = None
    """Counters of the device at the answer; None if the question was not reached."""
    pulse: Pulse | None = None
    """Pulse on the trigger line at the onset of the force; None without such a line, or if the force did not begin."""


def ask_participant(
    state: SessionState, due_trial: PresentTrial, question: Question, sitting: Sitting
) -> StimulusReply:
    """Play the stimulus, ask the question, and return the reply. In a direction trial the stimulus is still held
    then."""
    sitting.supervisor.start_activity("trial")
    if due_trial.phase is Phase.DETECTION:
        return _ask_detection(state, due_trial, question, sitting)
    sitting.device.hold(_make_stimulus(state, due_trial, sitting))
    # Read before the pulse is sent: the attempt to send a pulse may take time, which belongs to the response time.
    started_s = sitting.clock.now_s()
    pulse = sitting.pulse()
    sitting.hand.feel(due_trial, state.answers)
    reply = _await_reply(question, sitting)
    sitting.device.keep_alive()
    health = sitting.device.health()
    is_complete = health.fault is Fault.NONE
    return StimulusReply(reply, started_s, is_complete, play_result=None, holding=True, health=health, pulse=pulse)


def _ask_detection(state: SessionState, due_trial: PresentTrial, question: Question, sitting: Sitting) -> StimulusReply:
    """Play the stimulus in interval 1 or 2 (`due_trial.label`) and nothing in the other one, then ask for the
    interval."""
    play_result: PlaybackResult | None = None
    pulse: Pulse | None = None
    sitting.hand.feel(due_trial, state.answers)
    for interval in (1, 2):
        is_stimulus_interval = interval == due_trial.label
        if is_stimulus_interval:
            sitting.device.hold(_make_stimulus(state, due_trial, sitting))
            pulse = sitting.pulse()
        early_reply = _wait_in_interval(f"Interval {interval}", interval, state.protocol.detection.interval_s, sitting)
        if early_reply is not None:
            return StimulusReply(
                early_reply, sitting.clock.now_s(), False, play_result, is_stimulus_interval, pulse=pulse
            )
        if is_stimulus_interval:
            play_result = release_device(sitting)
        early_reply = _wait_in_interval("", 0, state.protocol.detection.gap_s, sitting) if interval == 1 else None
        if early_reply is not None:
            return StimulusReply(early_reply, sitting.clock.now_s(), False, play_result, holding=False, pulse=pulse)
    started_s = sitting.clock.now_s()
    reply = _await_reply(question, sitting)
    health = play_result.health if play_result is not None else None
    is_complete = health is not None and health.fault is Fault.NONE
    return StimulusReply(reply, started_s, is_complete, play_result, holding=False, health=health, pulse=pulse)


def _await_reply(question: Question, sitting: Sitting) -> Reply:
    """Ask the question and return the reply. A request to repeat the trial beyond the allowed number is ignored: the
    question is asked again."""
    while True:
        reply = sitting.supervisor.resolve(sitting.display.ask(question, sitting.supervisor.keep_alive))
        is_repeat_request = (
            isinstance(reply, Unanswered) and reply.repeat_requested and not (reply.pause or reply.ends_sitting)
        )
        if not is_repeat_request or question.repeats_left != 0 or not sitting.supervisor.keep_alive():
            return reply


def _wait_in_interval(title: str, interval_number: int, duration_s: float, sitting: Sitting) -> Unanswered | None:
    """Wait `duration_s` (s) during an interval or gap. None when it has passed; else why the wait ended: an answer
    before the question makes the trial void (`VoidCause.EARLY`). title, interval_number: empty and 0 in a gap."""
    reply = sitting.display.show_playing(
        PlayingNotice(title, interval_number, duration_s, picture=None), sitting.supervisor.keep_alive
    )
    if reply is None and sitting.supervisor.keep_alive():
        return None
    resolved_reply = sitting.supervisor.resolve(reply or Unanswered("the stimulus ended early", ends_sitting=False))
    return (
        Unanswered("answered before both intervals", ends_sitting=False, cause=VoidCause.EARLY)
        if isinstance(resolved_reply, Answered)
        else resolved_reply
    )


def _make_stimulus(state: SessionState, due_trial: PresentTrial, sitting: Sitting) -> HeldStimulus:
    """Make the stimulus of a trial, with its level converted to the quantity of the equalizer (N or m/s²)."""
    return make_held_stimulus(
        state.protocol.stimulus,
        compute_direction_vector(state.protocol.directions, due_trial.direction),
        due_trial.frequency_hz,
        due_trial.polarity
        * convert_level_to_amplitude(state.opened.equalized, due_trial.level_n, due_trial.frequency_hz),
        sitting.equalizer,
        sitting.device.info.sample_rate_hz,
    )
