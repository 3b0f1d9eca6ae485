"""Labelled demonstration before the trials: the participant chooses directions and frequencies and feels the stimuli.

The number of stimuli is not limited. A stimulus is logged before it is played.
"""

from protocols.procedure.schedule import draw_demo_level_n, label_direction
from study.devices.device import Fault
from study.session.facts.events import DemoFinished, DemoPlayed
from study.session.facts.level_scale import convert_level_to_amplitude
from study.session.state.due_trial import has_swapped_labels
from study.session.state.state import SessionState, is_felt_by_person
from study.session.stimulus.stimulus import compute_direction_angle_deg, compute_direction_vector, make_held_stimulus
from study.session.views.participant_views import (
    DemoDone,
    DemoMenu,
    PlayDemo,
    PlayingNotice,
    Unanswered,
    make_direction_picture,
)
from study.workflows.trial.action_result import (
    ActionResult,
    check_end_request,
    find_fault_end_reason,
    make_early_end_result,
)
from study.workflows.trial.sitting import Sitting, log_and_apply


def demonstrate(state: SessionState, sitting: Sitting) -> ActionResult:
    """Run the demonstration until the participant ends it or leaves, a pause or stop is requested, or a fault of the
    device ends the sitting. It can be run again."""
    felt_stimuli: tuple[tuple[int, int], ...] = ()
    vibration = 1
    while True:
        sitting.supervisor.start_activity("demo")
        choice = sitting.display.choose_demo(_make_menu(state, felt_stimuli, vibration), sitting.supervisor.keep_alive)
        end_result = check_end_request(state, sitting)
        if end_result is not None:
            return end_result
        if isinstance(choice, DemoDone):
            return ActionResult(log_and_apply(state, DemoFinished(utc=sitting.clock.utc()), sitting))
        vibration = choice.vibration
        demonstration_result = _play_demonstration(state, choice, sitting)
        state = demonstration_result.state
        if demonstration_result.end_reason or demonstration_result.pause:
            return demonstration_result
        if demonstration_result.void:
            sitting.display.trouble(f"That was cut short: {demonstration_result.void}.")
        else:
            felt_stimuli = (*felt_stimuli, (choice.vibration, choice.number))


def _make_menu(state: SessionState, felt_stimuli: tuple[tuple[int, int], ...], vibration: int) -> DemoMenu:
    """Make the menu. felt_stimuli: (vibration, direction number) of stimuli already played; vibration: number of the
    frequency that was chosen last, from 1."""
    return DemoMenu(
        picture=make_direction_picture(state.protocol.directions, has_swapped_labels(state.protocol, state.opened)),
        vibrations=len(state.protocol.all_frequencies_hz),
        vibration=vibration,
        played_pairs=felt_stimuli,
        handle_moves=is_felt_by_person(state.opened) is not False,
    )


def _play_demonstration(state: SessionState, choice: PlayDemo, sitting: Sitting) -> ActionResult:
    """Log and play one stimulus at its roved level (`draw_demo_level_n`). Returns how the demonstration continues;
    `void` where the stimulus ended early."""
    protocol = state.protocol
    frequency_hz = protocol.all_frequencies_hz[choice.vibration - 1]
    level_n = draw_demo_level_n(protocol.demo, state.opened.seed, state.sitting.demo_count)
    direction = label_direction(choice.number, has_swapped_labels(protocol, state.opened))
    demo_played = DemoPlayed(
        utc=sitting.clock.utc(),
        frequency_hz=frequency_hz,
        level_n=level_n,
        direction=1 if choice.number == 1 else 2,
        angle_deg=compute_direction_angle_deg(protocol.directions, direction),
        seconds=protocol.demo.seconds,
    )
    state = log_and_apply(state, demo_played, sitting)
    sitting.device.hold(
        make_held_stimulus(
            protocol.stimulus,
            compute_direction_vector(protocol.directions, direction),
            frequency_hz,
            convert_level_to_amplitude(state.opened.equalized, level_n, frequency_hz),
            sitting.equalizer,
            sitting.device.info.sample_rate_hz,
        )
    )
    picture = make_direction_picture(protocol.directions, has_swapped_labels(protocol, state.opened))
    notice = PlayingNotice(f"Direction {choice.number}", choice.number, protocol.demo.seconds, picture)
    reply = sitting.display.show_playing(notice, sitting.supervisor.keep_alive)
    fault = sitting.device.release().health.fault
    if end_reason := find_fault_end_reason(fault):
        return ActionResult(state, end_reason=end_reason, fault=fault)
    resolved_reply = sitting.supervisor.resolve(reply or Unanswered("", ends_sitting=False, repeat_requested=True))
    if isinstance(resolved_reply, Unanswered):
        early_end_result = make_early_end_result(state, resolved_reply)
        return (
            early_end_result
            if fault is Fault.NONE or early_end_result.end_reason
            else ActionResult(state, void=fault.value, fault=fault)
        )
    return ActionResult(state)
