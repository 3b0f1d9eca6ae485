"""Screen of `hapteq watch`, and of F2 and w in `hapteq study`: the experimenter's view of a running session, without
the direction of the open trial, with keys for stop, pause and notes."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical, VerticalScroll
from textual.message import Message
from textual.reactive import reactive
from textual.screen import Screen
from textual.widgets import Footer, Static

from study.errors import StudyError
from study.session.watching.requests import NoteAsked, PauseAsked, Request, StopAsked
from study.session.watching.watch_view import RUNNING_STATUSES, Alarm, WatchView
from study.tui.screens.note_prompt import NotePrompt
from study.tui.screens.watch_help import HELP, KEY_GUIDE
from study.tui.screens.watch_style import STYLE
from study.tui.watch import watch_panels
from study.tui.watch.level_history import LevelHistory
from study.tui.watch.watch_source import WatchSource
from study.tui.watch.watch_words import format_staircase_title

BELL_INTERVAL_S = 4.0
"""Interval (s) at which the bell repeats while an urgent alarm is not acknowledged. Chosen."""
SAME_ALARM_WITHIN_S = 10.0
"""Time (s) within which a recurring alarm counts as the same alarm; later it is new. Chosen."""

AlarmKey = tuple[str, str]
"""An alarm's kind and, for an event, its start time (UTC); the start time of a lasting state is not used: empty."""


class AlarmBook:
    """Records which alarms were acknowledged, and whether the bell is due. now_s: time by a monotonic clock (s)."""

    def __init__(self) -> None:
        self._alarms: tuple[Alarm, ...] = ()
        self._acknowledged: dict[AlarmKey, float] = {}
        """Acknowledged alarms, and when each was last present (s)."""
        self._announced: dict[AlarmKey, float] = {}
        """Alarms for which the bell has rung, and when each was last present (s)."""
        self._last_ring_s = float("-inf")

    @property
    def new_alarms(self) -> tuple[Alarm, ...]:
        """Current alarms that are not acknowledged."""
        return tuple(alarm for alarm in self._alarms if _make_key(alarm) not in self._acknowledged)

    @property
    def acknowledged_alarms(self) -> tuple[Alarm, ...]:
        """Current alarms that are acknowledged."""
        return tuple(alarm for alarm in self._alarms if _make_key(alarm) in self._acknowledged)

    def update(self, alarms: Sequence[Alarm], now_s: float) -> bool:
        """Replace the current alarms. Returns whether the bell rings: for a new alarm, or again for an urgent one."""
        self._alarms = tuple(alarms)
        present_keys = {_make_key(alarm) for alarm in alarms}
        for last_present_s in (self._acknowledged, self._announced):
            last_present_s.update({key: now_s for key in last_present_s if key in present_keys})
            for key in [key for key, last_s in last_present_s.items() if now_s - last_s > SAME_ALARM_WITHIN_S]:
                del last_present_s[key]
        new_keys = [_make_key(alarm) for alarm in self.new_alarms if _make_key(alarm) not in self._announced]
        is_bell_due = any(alarm.urgent for alarm in self.new_alarms) and now_s - self._last_ring_s >= BELL_INTERVAL_S
        if not new_keys and not is_bell_due:
            return False
        self._announced.update(dict.fromkeys(new_keys, now_s))
        self._last_ring_s = now_s
        return True

    def acknowledge(self, now_s: float) -> int:
        """Acknowledge all current alarms. Returns how many were new."""
        new_alarms = self.new_alarms
        self._acknowledged.update({_make_key(alarm): now_s for alarm in new_alarms})
        return len(new_alarms)


def _make_key(alarm: Alarm) -> AlarmKey:
    """Make the key by which a recurring alarm is recognised."""
    return alarm.kind, alarm.since if alarm.event else ""


POLL_EVERY_S = 0.1
"""Interval (s) at which the source is asked for a new view, and the alarms are updated. Chosen."""
STOP_TIMEOUT_S = 2.0
"""Time (s) after which a stop without effect is an alarm. Chosen."""
STALE_AFTER_S = 3.0
"""Time (s) without a new view after which an alarm states that the view is out of date. Chosen."""
MESSAGE_DURATION_S = 8.0
"""Time (s) for which a message is shown. Chosen."""


class WatchMessage(Message):
    """A new view of the session, to be shown."""

    def __init__(self, view: WatchView) -> None:
        super().__init__()
        self.view = view


class WatchScreen(Screen[None]):
    """The experimenter's view: status, alarms, staircase, trials, runs, exposure and device; redrawn with each view."""

    HELP = HELP
    HORIZONTAL_BREAKPOINTS = [(0, "-narrow"), (126, "-wide")]  # noqa: RUF012 - as in the base class
    CSS = STYLE
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("S,f8", "stop", "STOP", key_display="S"),
        Binding("p", "pause", "Pause"),
        Binding("n", "note(False)", "Note"),
        Binding("e", "note(True)", "Adverse"),
        Binding("a", "acknowledge", "Seen"),
        Binding("d", "details", "Details"),
        Binding("f1,question_mark", "help", "Help", key_display="F1"),
        Binding("t", "app.next_theme", "Theme", show=False),
        Binding("q", "leave", "Leave"),
    ]
    view: reactive[WatchView | None] = reactive(None)

    class Closed(Message):
        """Posted when the experimenter closes the view; the session continues."""

    def __init__(
        self, source: WatchSource, deliver: Callable[[Request], object], clock_s: Callable[[], float] = time.monotonic
    ) -> None:
        """deliver: passes a request to the session, or raises StudyError. clock_s: monotonic clock, seconds."""
        super().__init__()
        self._clock_s = clock_s
        self._source = source
        self._deliver = deliver
        self._alarm_book = AlarmBook()
        self._latest_view: WatchView | None = None
        self._last_update_s = self._clock_s()
        self._stop_sent_s: float | None = None
        self._stopped_by_request = False
        self._message_shown_s = float("-inf")

    def compose(self) -> ComposeResult:
        yield Static(id="standing")
        yield Static(KEY_GUIDE, id="guide")
        yield Static(id="alarms")
        with Horizontal():
            with Vertical(id="left"):
                with Vertical(id="levels", classes="panel"):
                    yield LevelHistory(id="history")
                yield Static(id="trials", classes="panel")
            with Vertical(id="right"):
                yield Static(id="runs", classes="panel")
                yield Static(id="gauges", classes="panel")
            with VerticalScroll(id="aside", classes="panel"):
                yield Static(id="details")
        yield Footer(show_command_palette=False)

    def on_mount(self) -> None:
        self.query_one("#standing", Static).update("Opening the session …")
        titles = {"#trials": "Last trials", "#runs": "Runs", "#gauges": "Exposure and device", "#aside": "Details"}
        for name, title in titles.items():
            self.query_one(name).border_title = title
        self.set_interval(POLL_EVERY_S, self.poll)
        self.poll()

    def poll(self) -> None:
        """Check for a new view, for alarms, and whether a stop was executed."""
        view = self._source.latest()
        if view is not None and view is not self._latest_view:
            self._latest_view = view
            self.post_message(WatchMessage(view))
        elif self.is_mounted:
            self._redraw()

    def on_watch_message(self, message: WatchMessage) -> None:
        self._last_update_s = self._clock_s()
        self._stopped_by_request = self._stopped_by_request and message.view.standing not in RUNNING_STATUSES
        self.view = message.view

    def watch_view(self, view: WatchView | None) -> None:
        if view is None:
            return
        self._redraw()
        self.query_one("#standing", Static).update(watch_panels.format_status_line(view))
        self.query_one("#levels").border_title = format_staircase_title(view)
        self.query_one(LevelHistory).show(view.points, view.next_level_n, view.cap_n)
        self.query_one("#details", Static).update(watch_panels.format_details(view))
        self.query_one("#gauges", Static).update(watch_panels.format_gauges(view))
        # A change of the alarms panel above changes the height of the tables.
        self.call_after_refresh(self._fill_tables)

    def on_resize(self) -> None:
        self.call_after_refresh(self._fill_tables)

    def _fill_tables(self) -> None:
        """Fill the tables of runs and trials with the rows that fit into their panels; nothing without a view."""
        if self.view is None:
            return
        runs, trials = self.query_one("#runs", Static), self.query_one("#trials", Static)
        runs.update(watch_panels.format_runs(self.view, runs.content_size.height))
        trials.update(watch_panels.format_trials(self.view, trials.content_size.height, trials.content_size.width))

    def _redraw(self) -> None:
        """Update the alarms, ring the bell if it is due, and replace an expired message by the key guide."""
        now_s = self._clock_s()
        alarms = (*self._find_view_alarms(now_s), *self._filter_session_alarms())
        if self._alarm_book.update(alarms, now_s):
            self.app.bell()
        self._show_alarms()
        if now_s - self._message_shown_s > MESSAGE_DURATION_S:
            self._update_guide(KEY_GUIDE, reply=False)

    def _filter_session_alarms(self) -> tuple[Alarm, ...]:
        """Filter the session's alarms: an end of the session that was requested on this screen is no alarm."""
        alarms = self.view.alarms if self.view is not None else ()
        return tuple(alarm for alarm in alarms if not (self._stopped_by_request and alarm.kind == "ended"))

    def _find_view_alarms(self, now_s: float) -> list[Alarm]:
        """Find alarms about this view: no new data, or a stop without effect. Shows a message for an executed stop."""
        since_utc = self.view.utc if self.view is not None else ""
        alarms = []
        if self._stop_sent_s is not None and self.view is not None and self.view.standing not in RUNNING_STATUSES:
            self._stop_sent_s, self._stopped_by_request = None, True
            self._show_message(f"The session has stopped: {self.view.reason}.")
        if self._stop_sent_s is not None and now_s - self._stop_sent_s > STOP_TIMEOUT_S:
            sentence = "The session has not answered the stop. Hand off the handle; switch the device off."
            alarms.append(Alarm("stop unheard", sentence, since_utc))
        if self._source.problem:
            alarms.append(Alarm("no reader", f"This view receives no more data: {self._source.problem}", since_utc))
        elif self.view is not None and now_s - self._last_update_s > STALE_AFTER_S:
            alarms.append(
                Alarm("no news", "This view has not been updated for seconds; look at the session itself.", since_utc)
            )
        return alarms

    def _show_alarms(self) -> None:
        new_alarms, acknowledged_alarms = self._alarm_book.new_alarms, self._alarm_book.acknowledged_alarms
        panel = self.query_one("#alarms", Static)
        panel.set_class(bool(new_alarms or acknowledged_alarms), "any")
        panel.set_class(not new_alarms, "seen")
        panel.border_title = "! ALARM: press a when you have seen it" if new_alarms else "Alarms that you have seen"
        panel.update(watch_panels.format_alarms(new_alarms, acknowledged_alarms))

    def action_stop(self) -> None:
        self._stop_sent_s = self._clock_s()
        self._send_request(StopAsked("experimenter"), "Stop sent: the force goes off at once.")

    def action_pause(self) -> None:
        if self.view is not None and self.view.standing == "paused":
            self._show_message("It is paused already; the participant continues at their own screen.")
            return
        self._send_request(PauseAsked("experimenter"), "Pause sent. The participant continues at their own screen.")

    def action_note(self, adverse: bool) -> None:
        def send_note(text: str | None) -> None:
            if text:
                self._send_request(
                    NoteAsked("experimenter", text, adverse), "Sent: the session writes it into the log."
                )

        self.app.push_screen(NotePrompt(adverse, self.action_stop), send_note)

    def action_acknowledge(self) -> None:
        count = self._alarm_book.acknowledge(self._clock_s())
        self._show_message(
            f"{count} alarm{'' if count == 1 else 's'} seen." if count else "There is no alarm to be seen."
        )
        self._show_alarms()

    def action_details(self) -> None:
        self.toggle_class("details")
        self.call_after_refresh(self._fill_tables)

    def action_help(self) -> None:
        from study.tui.screens.help import HelpScreen

        self.app.push_screen(HelpScreen(HELP))

    def action_leave(self) -> None:
        self.post_message(self.Closed())

    def _send_request(self, request: Request, text: str) -> None:
        """Send a request and show `text`, or the reason why it was not sent or has no effect."""
        try:
            self._deliver(request)
        except StudyError as error:
            self._show_message(f"NOT sent: {error.happened} {error.do_now}")
            self.app.bell()
            return
        if self.view is not None and self.view.standing not in RUNNING_STATUSES:
            text = "Nothing runs here; it was sent all the same."
        self._show_message(text)

    def _show_message(self, sentence: str) -> None:
        self._message_shown_s = self._clock_s()
        self._update_guide(sentence, reply=True)

    def _update_guide(self, sentence: str, reply: bool) -> None:
        self.query_one("#guide", Static).set_class(reply, "said").update(sentence)
