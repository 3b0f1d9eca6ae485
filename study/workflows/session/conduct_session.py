"""Conduct a whole sitting, from opening the device to closing the log.

Order: open trigger line, masking noise and device, make or reload the equalizer, open or resume the session
(`open_session`, `resume_session`), then run it (`run_session`); everything is closed at the end, also after an error.
"""

import contextlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from protocols.definition.study_protocol import StudyProtocol
from study.devices.clock import Clock
from study.devices.device import Device, DeviceInfo, Fault
from study.devices.opening import open_device, open_lab_onset_line
from study.errors import DeviceError
from study.session.state.state import SessionState
from study.session.stimulus.stimulus import MIN_SAMPLES_PER_PERIOD
from study.store.sessions.archive import SessionFolder
from study.store.sessions.live_file import write_live
from study.store.sessions.request_inbox import RequestInbox
from study.workflows.device_settings import make_device_settings
from study.workflows.results.fold_session import fold_session
from study.workflows.session.equalize_stimuli import (
    SessionEqualizer,
    check_model_for_protocol,
    equalize_stimuli,
    load_equalizer,
    reload_equalizer,
)
from study.workflows.session.open_session import OpenedSession, SessionPlan, open_session
from study.workflows.session.resume_session import resume_session
from study.workflows.session.run_session import run_session
from study.workflows.trial.display import Display, Hand
from study.workflows.trial.masking import open_masking_sound
from study.workflows.trial.requests_port import CombinedRequests, QueuedRequests, RequestPort
from study.workflows.trial.session_supervisor import SessionSupervisor
from study.workflows.trial.sitting import (
    Pulse,
    Sitting,
    SoundOutput,
    notify_experimenter,
    report_clock_steps,
    send_no_pulse,
)

RATE_TOLERANCE = 1e-3
"""Share by which a device may be slower than a stimulus needs: a recorded rate is that of a clock. Chosen."""


def _ignore_opened_session(folder: SessionFolder, device: Device) -> None:
    """Do nothing: default of `Participant.on_session_opened`."""


@dataclass(frozen=True, slots=True)
class Participant:
    """Ports of the participant at the device: display, hand, clock and requests."""

    display: Display
    hand: Hand
    clock: Clock
    requests: RequestPort = field(default_factory=QueuedRequests)
    """Requests from within this program: notes typed at the display, a stop from another screen."""
    on_session_opened: Callable[[SessionFolder, Device], None] = _ignore_opened_session
    """Called once with the session's folder, whose lock is held, and the device, which may be stopped from any
    thread."""


@dataclass(frozen=True, slots=True)
class ConductedSitting:
    """Result of a sitting: the session's state, and why the sitting ended."""

    folder: SessionFolder
    device_name: str
    """Name of the device, as `open_device` takes it."""
    state: SessionState
    end_reason: str
    """Why the sitting ended before the session was finished; empty if it is finished."""
    fault: Fault
    """Fault of the device, if it ended the sitting; otherwise `Fault.NONE`."""
    fault_text: str = ""
    """Message of the driver about the fault; empty without one."""
    withdrawn: bool = False
    """Whether the participant withdrew consent: the caller then erases the data."""


def conduct_new(plan: SessionPlan, device_name: str, participant: Participant) -> ConductedSitting:
    """Open the device, then a new session, and run it. Raises StudyError where device, model, sound output or session
    cannot be opened, and DeviceError where a required accelerometer is missing or the device is too slow."""
    check_model_for_protocol(plan.protocol, plan.model)
    with _open_equipment(plan.protocol, device_name, participant.clock, plan.observer, plan.seed) as equipment:
        pulse, sound, device = equipment
        equalized = equalize_stimuli(plan.protocol, plan.model, device.info)
        with open_session(plan, device.info, equalized, participant.clock) as opened_session:
            return _run_sitting(opened_session, Equipment(device_name, device, equalized, pulse, sound), participant)


def conduct_resumed(folder: SessionFolder, device_name: str, participant: Participant) -> ConductedSitting:
    """Rebuild the state from the log, open the device, and continue the session. Raises as `conduct_new`."""
    state = fold_session(folder).state
    if state.opened.equalized is not None:
        load_equalizer()
    opened = state.opened
    with _open_equipment(state.protocol, device_name, participant.clock, opened.observer, opened.seed) as equipment:
        pulse, sound, device = equipment
        equalized = reload_equalizer(folder, state, device.info)
        with resume_session(folder, device.info, participant.clock) as opened_session:
            earlier_step_count = len(state.sitting.clock_steps)
            return _run_sitting(
                opened_session, Equipment(device_name, device, equalized, pulse, sound), participant, earlier_step_count
            )


@contextlib.contextmanager
def _open_equipment(
    protocol: StudyProtocol, device_name: str, clock: Clock, observer: str | None, seed: int
) -> Iterator[tuple[Callable[[], Pulse | None], SoundOutput | None, Device]]:
    """Open trigger line, masking sound and device, and check that the device suits the protocol. Raises StudyError
    where one cannot be opened, and DeviceError for an unsuitable device."""
    with (
        _open_pulse_line(clock) as pulse,
        open_masking_sound(protocol.masking, clock, observer) as sound,
        contextlib.closing(open_device(device_name, make_device_settings(protocol), clock, seed)) as device,
    ):
        _check_sensor(protocol, device.info)
        _check_rate(protocol, device.info)
        _check_fades(protocol, device.info)
        yield pulse, sound, device


def _check_sensor(protocol: StudyProtocol, info: DeviceInfo) -> None:
    """Check that the device has an accelerometer if the protocol needs it. Raises DeviceError otherwise."""
    if protocol.measurement.accelerometer_needed and not info.has_sensor:
        raise DeviceError(
            "The sitting did not begin: its protocol needs the accelerometer",
            f"None is configured for the {info.name}.",
            "`hapteq doctor` on it says how to add one; or set accelerometer_needed = false in the protocol.",
        )


def _check_rate(protocol: StudyProtocol, info: DeviceInfo) -> None:
    """Check that each stimulus has `MIN_SAMPLES_PER_PERIOD` at the device's rate; from half the rate on it would be
    zero or of another frequency. Raises DeviceError otherwise, apart from `RATE_TOLERANCE`."""
    probe_hz = protocol.probes.to_hz if protocol.probes.is_enabled else 0.0
    highest_hz = max((*protocol.all_frequencies_hz, probe_hz))
    if info.sample_rate_hz * (1 + RATE_TOLERANCE) < MIN_SAMPLES_PER_PERIOD * highest_hz:
        raise DeviceError(
            "The sitting did not begin: the device is too slow for its protocol",
            f"The {info.name} runs at {info.sample_rate_hz:g} Hz, and {highest_hz:g} Hz need at least "
            f"{MIN_SAMPLES_PER_PERIOD * highest_hz:g}.",
            "Take a device of a higher rate, or lower frequencies in the protocol.",
            saved="Nothing moved.",
        )


def _check_fades(protocol: StudyProtocol, info: DeviceInfo) -> None:
    """Check that no fade of a stimulus is rounded to 0 ticks of the device. Raises DeviceError otherwise."""
    shortest_fade_s = min(protocol.stimulus.fade_in_s, protocol.stimulus.fade_out_s)
    if round(shortest_fade_s * info.sample_rate_hz) == 0:
        raise DeviceError(
            "The sitting did not begin: a fade of its protocol is too short",
            f"{shortest_fade_s:g} s (stimulus.fade_in_s or fade_out_s) is no more than half a tick of the {info.name}, "
            f"which runs at {info.sample_rate_hz:g} Hz: the force would jump.",
            f"Take a device of a higher rate, or set both to at least {1 / info.sample_rate_hz:g} s.",
            saved="Nothing moved.",
        )


@contextlib.contextmanager
def _open_pulse_line(clock: Clock) -> Iterator[Callable[[], Pulse | None]]:
    """Open the trigger line of the lab and yield the function that sends a pulse; one that sends none without a line,
    and in virtual time, which passes faster than that of a recorder."""
    onset_line = None if clock.virtual else open_lab_onset_line()
    try:
        yield send_no_pulse if onset_line is None else onset_line.send_pulse
    finally:
        if onset_line is not None:
            onset_line.close()


@dataclass(frozen=True, slots=True)
class Equipment:
    """Equipment of a sitting: device, equalizer of the stimuli, trigger line, and masking noise."""

    device_name: str
    """Name of the device, as `open_device` takes it."""
    device: Device
    equalized: SessionEqualizer
    """Equalizer of the session's stimuli, with the model and level scales for the log."""
    pulse: Callable[[], Pulse | None]
    """Sends a pulse on the trigger line."""
    sound: SoundOutput | None
    """Output of the masking noise; None where none is played."""


def _run_sitting(
    opened_session: OpenedSession, equipment: Equipment, participant: Participant, earlier_step_count: int = 0
) -> ConductedSitting:
    """Run the opened session. earlier_step_count: number of clock steps before this sitting; only new ones are
    reported."""
    folder, protocol, device = opened_session.folder, opened_session.state.protocol, equipment.device
    participant.on_session_opened(folder, device)
    place_m = make_device_settings(protocol).place_m
    inbox = RequestInbox(folder.path)
    supervisor = SessionSupervisor(
        device,
        participant.clock,
        CombinedRequests(participant.requests, inbox),
        publish=lambda live: write_live(folder.path, live),
        buttons=protocol.trial.device_buttons,
        place_m=place_m,
    )
    sitting = Sitting(
        folder=folder,
        log=opened_session.log,
        clock=participant.clock,
        device=device,
        equalizer=equipment.equalized.equalizer,
        display=participant.display,
        hand=participant.hand,
        supervisor=supervisor,
        device_name=equipment.device_name,
        place_m=place_m,
        pulse=equipment.pulse,
        masking_noise=equipment.sound,
    )
    report_clock_steps(opened_session.state.sitting.clock_steps[earlier_step_count:], sitting)
    for session_name in opened_session.state.sitting.unread_sessions:
        notify_experimenter(
            f"{session_name} cannot be read: what the hand got in it is not in the vibration dose of today.", sitting
        )
    end = run_session(opened_session.state, sitting)
    return ConductedSitting(
        folder, equipment.device_name, end.state, end.end_reason, end.fault, end.fault_text, end.withdrawn
    )
