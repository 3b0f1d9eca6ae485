"""Background tasks while the session waits: the device's sign of life, requests, buttons, live state."""

import math
from collections.abc import Callable

from study.devices.clock import Clock
from study.devices.device import Device, Fault, Look
from study.session.views.views import Answered, Reply, Unanswered
from study.session.watching.live import Activity, Live
from study.session.watching.requests import NoteAsked, PauseAsked, RequestSource, StopAsked
from study.workflows.trial.requests_port import Requests

LIVE_EVERY_S = 0.25
"""Interval of the live state: often enough for a viewer, with little load on the disk."""

PLAYING = ("trial", "demo", "probe", "reference")
"""Activities in which the device holds a stimulus: a fault ends their wait."""


class SessionSupervisor:
    """One per sitting. `sign_of_life` is the sign of life of every wait; `resolve` returns afterwards what ended it."""

    def __init__(
        self,
        device: Device,
        clock: Clock,
        requests: Requests,
        publish: Callable[[Live], None],
        buttons: tuple[int, ...] = (),
        place_m: tuple[float, float, float] = (0.0, 0.0, 0.0),
    ) -> None:
        self._device = device
        self._clock = clock
        self._requests = requests
        self._publish = publish
        self._buttons = buttons
        self._place_m = place_m
        self._buttons_up = False
        self._published_s = float("-inf")
        self._activity: Activity = "preparing"
        self._since_utc = clock.utc()
        self._handle_ready = True
        self._notes: list[NoteAsked] = []
        self._answer: Answered | None = None
        self.stop_asked: RequestSource | None = None
        self.pause_asked: RequestSource | None = None

    def start_activity(self, activity: Activity) -> None:
        """Start a new wait: a button still held from the last one does not answer it."""
        self._activity, self._since_utc = activity, self._clock.utc()
        self._buttons_up = False
        self._answer = None
        self._handle_ready = True
        self._published_s = float("-inf")
        self.listen()
        self._report()

    def sign_of_life(self) -> bool:
        """The sign of life. False where the wait is over: a fault, a request, a button."""
        self._device.keep_alive()
        self.listen()
        self._report()
        if self._activity == "pause":
            return self.stop_asked is None
        if self.stop_asked is not None or self.pause_asked is not None or self._answer is not None:
            return False
        # Between stimuli the fault of the last one is still reported, although it is over.
        return self._activity not in PLAYING or self._device.fault() is Fault.NONE

    def listen(self) -> None:
        """Take pending requests. A stop releases the force at once."""
        for request in self._requests.take():
            match request:
                case StopAsked(who=who):
                    self._device.stop()
                    self.stop_asked = who
                case PauseAsked(who=who):
                    self.pause_asked = who
                case NoteAsked():
                    self._notes.append(request)

    def resolve(self, reply: Reply) -> Reply:
        """The reply of a wait: what ended it, where the display only knows that it ended."""
        if self.stop_asked is not None:
            return Unanswered(f"the {self.stop_asked} stopped the session", ends_sitting=True)
        if isinstance(reply, Answered):
            return reply
        if self._answer is not None:
            return self._answer
        if self.pause_asked is not None:
            return Unanswered(
                f"the {self.pause_asked} asked for a pause", ends_sitting=False, repeat_requested=True, pause=True
            )
        return reply

    def note(self, note: NoteAsked) -> None:
        """Keep a note until `take_notes`; nothing is written yet."""
        self._notes.append(note)

    def take_notes(self) -> tuple[NoteAsked, ...]:
        """Notes since the last call, oldest first."""
        notes, self._notes = tuple(self._notes), []
        return notes

    def handle_is(self, ready: bool) -> None:
        """Whether the handle is at its place: shown to viewers, until the next `start_activity`."""
        self._handle_ready = ready

    def _report(self) -> None:
        now_s = self._clock.now_s()
        is_due = not self._clock.virtual and now_s - self._published_s >= LIVE_EVERY_S
        if not is_due and not self._buttons:
            return
        look = self._device.look()
        self._press(look, now_s)
        if is_due:
            self._published_s = now_s
            self._publish(self._live_state(look))

    def _press(self, look: Look, now_s: float) -> None:
        pressed = [number for number in self._buttons if number in look.buttons]
        if not pressed:
            self._buttons_up = True
        elif self._buttons_up and len(pressed) == 1 and self._activity == "trial" and self._answer is None:
            self._answer = Answered(1 + self._buttons.index(pressed[0]), now_s)

    def offset_m(self, look: Look) -> tuple[float, float, float] | None:
        """Offset of the handle from its place; None without a reading."""
        if look.position_m is None:
            return None
        (x, y, z), (x0, y0, z0) = look.position_m, self._place_m
        return (x - x0, y - y0, z - z0)

    def _live_state(self, look: Look) -> Live:
        fault, offset, acceleration = self._device.fault(), self.offset_m(look), look.acceleration_mps2
        return Live(
            utc=self._clock.utc(),
            activity=self._activity,
            since_utc=self._since_utc,
            fault="" if fault is Fault.NONE else fault.value,
            offset_mm=None if offset is None else 1000.0 * math.hypot(*offset),
            handle_ready=self._handle_ready,
            acceleration_mps2=None if acceleration is None else math.hypot(*acceleration),
            sensor_clipped=look.sensor_clipped,
            missed_ticks=look.missed_ticks,
            monotonic_s=self._clock.now_s(),
            telemetry=self._device.telemetry,
        )
