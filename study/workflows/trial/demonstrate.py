"""Labelled demonstration before the trials: the participant chooses a direction and a frequency and feels the stimulus,
as often as wanted. Every stimulus is logged before it is played."""

from protocols.procedure.schedule import demo_level_n, label_of
from study.devices.device import Fault
from study.session.facts.events import DemoFinished, DemoPlayed
from study.session.facts.level_scale import equalizer_amplitude
from study.session.state.due_trial import labels_are_swapped
from study.session.state.state import SessionState, felt
from study.session.stimulus.stimulus import direction_angle_deg, direction_vector, held_stimulus
from study.session.views.views import DemoDone, DemoMenu, PlayDemo, PlayingNotice, Unanswered, picture_of
from study.workflows.trial.after_trial import AfterTrial, check_end_request, cut_short, reason_to_leave
from study.workflows.trial.sitting import Sitting, record


def demonstrate(state: SessionState, sitting: Sitting) -> AfterTrial:
    """Run the demonstration until the participant ends it, leaves, or a pause is requested. It can be run again."""
    felt_so_far: tuple[tuple[int, int], ...] = ()
    vibration = 1
    while True:
        sitting.supervisor.begin("demo")
        choice = sitting.display.choose_demo(_menu(state, felt_so_far, vibration), sitting.supervisor.glance)
        ended = check_end_request(state, sitting)
        if ended is not None:
            return ended
        if isinstance(choice, DemoDone):
            return AfterTrial(record(state, DemoFinished(utc=sitting.clock.utc()), sitting))
        vibration = choice.vibration
        after = _play_demonstration(state, choice, sitting)
        state = after.state
        if after.leave or after.pause:
            return after
        if after.void:
            sitting.display.trouble(f"That was cut short: {after.void}.")
        else:
            felt_so_far = (*felt_so_far, (choice.vibration, choice.number))


def _menu(state: SessionState, felt_so_far: tuple[tuple[int, int], ...], vibration: int) -> DemoMenu:
    """The menu. felt_so_far: (vibration, direction number) of stimuli already played; vibration: the last chosen."""
    return DemoMenu(
        picture=picture_of(state.protocol.directions, labels_are_swapped(state.protocol, state.opened)),
        vibrations=len(state.protocol.all_frequencies_hz),
        vibration=vibration,
        felt=felt_so_far,
        handle_moves=felt(state.opened) is not False,
    )


def _play_demonstration(state: SessionState, choice: PlayDemo, sitting: Sitting) -> AfterTrial:
    """Log and play one stimulus at its roved level (`demo_level_n`); returns how the demonstration continues."""
    protocol = state.protocol
    frequency_hz = protocol.all_frequencies_hz[choice.vibration - 1]
    level_n = demo_level_n(protocol.demo, state.opened.seed, state.sitting.demos)
    direction = label_of(choice.number, labels_are_swapped(protocol, state.opened))
    played = DemoPlayed(
        utc=sitting.clock.utc(),
        frequency_hz=frequency_hz,
        level_n=level_n,
        direction=1 if choice.number == 1 else 2,
        angle_deg=direction_angle_deg(protocol.directions, direction),
        seconds=protocol.demo.seconds,
    )
    state = record(state, played, sitting)
    sitting.device.hold(
        held_stimulus(
            protocol.stimulus,
            direction_vector(protocol.directions, direction),
            frequency_hz,
            equalizer_amplitude(state.opened.equalized, level_n, frequency_hz),
            sitting.equalizer,
            sitting.device.info.sample_rate_hz,
        )
    )
    picture = picture_of(protocol.directions, labels_are_swapped(protocol, state.opened))
    notice = PlayingNotice(f"Direction {choice.number}", choice.number, protocol.demo.seconds, picture)
    reply = sitting.display.show_playing(notice, sitting.supervisor.glance)
    fault = sitting.device.release().health.fault
    if leave := reason_to_leave(fault):
        return AfterTrial(state, leave=leave, fault=fault)
    resolved = sitting.supervisor.resolve(reply or Unanswered("", leave=False, asked=True))
    if isinstance(resolved, Unanswered):
        after = cut_short(state, resolved)
        return after if fault is Fault.NONE or after.leave else AfterTrial(state, void=fault.value, fault=fault)
    return AfterTrial(state)
