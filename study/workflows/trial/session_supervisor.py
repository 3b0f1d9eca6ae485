"""Periodic tasks of a session while it waits: keep-alive calls, requests, buttons of the device, live state."""

import math
from collections.abc import Callable

from study.devices.clock import Clock
from study.devices.device import Device, Fault, Look
from study.session.views.participant_views import Answered, Reply, Unanswered
from study.session.watching.live_state import Activity, LiveState
from study.session.watching.requests import NoteAsked, PauseAsked, RequestSource, StopAsked
from study.workflows.trial.requests_port import RequestPort

LIVE_INTERVAL_S = 0.25
"""Interval (s) at which the live state is published: often enough for a viewer, with little load on the disk.
Chosen."""

PLAYING_ACTIVITIES = ("trial", "demo", "probe", "reference")
"""Activities in which the device holds or plays a stimulus: a fault ends their wait."""


class SittingStoppedError(Exception):
    """A stop was requested while a form or a notice waited for the participant; the device is stopped already."""


class SessionSupervisor:
    """Supervisor of one sitting. `keep_alive` is the keep-alive callback (`SignOfLife`) of every wait; afterwards
    `resolve` returns the reply of the wait: the answer, or the reason why there is none. `stop_requester` and
    `pause_requester` are None until such a request is taken."""

    def __init__(
        self,
        device: Device,
        clock: Clock,
        requests: RequestPort,
        publish: Callable[[LiveState], None],
        buttons: tuple[int, ...] = (),
        place_m: tuple[float, float, float] = (0.0, 0.0, 0.0),
    ) -> None:
        """publish: called with the live state, for viewers. buttons: numbers of the device's buttons that answer 1, 2.
        place_m: start position of the handle (m), from which `compute_offset_m` measures."""
        self._device = device
        self._clock = clock
        self._requests = requests
        self._publish = publish
        self._buttons = buttons
        self._place_m = place_m
        self._buttons_released = False
        self._last_published_s = float("-inf")
        self._activity: Activity = "preparing"
        self._activity_start_utc = clock.utc()
        self._handle_ready = True
        self._notes: list[NoteAsked] = []
        self._answer: Answered | None = None
        self.stop_requester: RequestSource | None = None
        self.pause_requester: RequestSource | None = None

    def start_activity(self, activity: Activity) -> None:
        """Start a new wait: take pending requests and, unless the clock is virtual, publish the live state. A button
        that is still held from the last wait does not answer this one."""
        self._activity, self._activity_start_utc = activity, self._clock.utc()
        self._buttons_released = False
        self._answer = None
        self._handle_ready = True
        self._last_published_s = float("-inf")
        self.listen()
        self._read_buttons_and_publish()

    def keep_alive(self) -> bool:
        """Reset the device's watchdog, take requests and button presses, publish the live state. False where the wait
        is over: after a fault in `PLAYING_ACTIVITIES`, a stop or pause request, or an answer by a button; in a pause
        only after a stop request."""
        self._device.keep_alive()
        self.listen()
        self._read_buttons_and_publish()
        if self._activity == "pause":
            return self.stop_requester is None
        if self.stop_requester is not None or self.pause_requester is not None or self._answer is not None:
            return False
        # Between stimuli the device still reports the fault of the last stimulus.
        return self._activity not in PLAYING_ACTIVITIES or self._device.fault() is Fault.NONE

    def listen(self) -> None:
        """Take pending requests: stop, pause, notes. A stop request stops the device, which releases the force at
        once."""
        for request in self._requests.take():
            match request:
                case StopAsked(who=who):
                    self._device.stop()
                    self.stop_requester = who
                case PauseAsked(who=who):
                    self.pause_requester = who
                case NoteAsked():
                    self._notes.append(request)

    @property
    def stop_reason(self) -> str:
        """Why a requested stop ends the sitting, a clause; empty without a request."""
        return f"the {self.stop_requester} stopped the session" if self.stop_requester else ""

    def listen_for_stop(self) -> None:
        """Take pending requests while a form or a notice is open, in which nothing plays. Raises SittingStoppedError
        once a stop is requested; a pause begins after the form."""
        self.listen()
        if self.stop_requester is not None:
            raise SittingStoppedError

    def resolve(self, reply: Reply) -> Reply:
        """Choose the reply to a wait, by priority: a stop request, the answer on the display, the answer by a button, a
        pause request, the other reply of the display."""
        if self.stop_requester is not None:
            return Unanswered(self.stop_reason, ends_sitting=True)
        if isinstance(reply, Answered):
            return reply
        if self._answer is not None:
            return self._answer
        if self.pause_requester is not None:
            return Unanswered(
                f"the {self.pause_requester} asked for a pause", ends_sitting=False, repeat_requested=True, pause=True
            )
        return reply

    def add_note(self, note: NoteAsked) -> None:
        """Store a note until `drop_note`; nothing is written yet."""
        self._notes.append(note)

    @property
    def next_note(self) -> NoteAsked | None:
        """The oldest note that is not logged; None without one."""
        return self._notes[0] if self._notes else None

    def drop_note(self) -> None:
        """Forget the oldest note, because it is logged."""
        del self._notes[0]

    def set_handle_ready(self, ready: bool) -> None:
        """Set whether the handle is at its start position, for viewers; True again after the next `start_activity`."""
        self._handle_ready = ready

    def _read_buttons_and_publish(self) -> None:
        """Read the buttons at each call; publish the live state if `LIVE_INTERVAL_S` has passed since the last time,
        and the clock is not virtual."""
        now_s = self._clock.now_s()
        is_due = not self._clock.virtual and now_s - self._last_published_s >= LIVE_INTERVAL_S
        if not is_due and not self._buttons:
            return
        look = self._device.look()
        self._take_button_answer(look, now_s)
        if is_due:
            self._last_published_s = now_s
            self._publish(self._make_live_state(look))

    def _take_button_answer(self, look: Look, now_s: float) -> None:
        """Take a newly pressed button as the answer of a trial: exactly one button, after all were released; only the
        first answer of a trial counts. now_s: monotonic time (s) of the answer."""
        pressed_buttons = [number for number in self._buttons if number in look.buttons]
        if not pressed_buttons:
            self._buttons_released = True
        elif (
            self._buttons_released and len(pressed_buttons) == 1 and self._activity == "trial" and self._answer is None
        ):
            self._answer = Answered(1 + self._buttons.index(pressed_buttons[0]), now_s)

    def compute_offset_m(self, look: Look) -> tuple[float, float, float] | None:
        """Compute the offset (x, y, z) of the handle from its start position (m); None without a position reading."""
        if look.position_m is None:
            return None
        (x, y, z), (x0, y0, z0) = look.position_m, self._place_m
        return (x - x0, y - y0, z - z0)

    def _make_live_state(self, look: Look) -> LiveState:
        """Make the state of device and session for viewers: distance from the start position in mm, magnitude of the
        acceleration in m/s²; None without a reading."""
        fault, offset_m, acceleration_mps2 = self._device.fault(), self.compute_offset_m(look), look.acceleration_mps2
        return LiveState(
            utc=self._clock.utc(),
            activity=self._activity,
            since_utc=self._activity_start_utc,
            fault="" if fault is Fault.NONE else fault.value,
            offset_mm=None if offset_m is None else 1000.0 * math.hypot(*offset_m),
            handle_ready=self._handle_ready,
            acceleration_mps2=None if acceleration_mps2 is None else math.hypot(*acceleration_mps2),
            sensor_clipped=look.sensor_clipped,
            missed_ticks=look.missed_ticks,
            monotonic_s=self._clock.now_s(),
            telemetry=self._device.telemetry,
        )
