"""The watcher's screen: what it says, what its keys ask for, and when it rings."""

import asyncio
import os
import time
from dataclasses import replace
from pathlib import Path

import pytest

from study.devices.clock import VirtualClock
from study.errors import StudyError
from study.session.watching.live import Live
from study.session.watching.requests import NoteAsked, PauseAsked, StopAsked
from study.session.watching.watch_view import (
    Alarm,
    ClosedTrial,
    Exposure,
    FormLine,
    NoteLine,
    OpenTrial,
    PracticeLine,
    StaircasePoint,
    WatchedRun,
    WatchView,
)
from study.tui.watch.watch_app import WatchApp
from study.tui.watch.watch_screen import NO_NEWS_AFTER_S, RING_EVERY_S, UNHEARD_AFTER_S

HERE = Path(__file__).parent
UTC = "2026-11-22T10:17:00.000+00:00"
LIVE = Live(UTC, "trial", UTC, "", 1.2, True, 3.3, False, 0)
FRAMES = {ord(character): " " for character in "┏┓┗┛┃━╭╮╰╯│─"}
STOP, PAUSE = StopAsked("experimenter"), PauseAsked("experimenter")

LEVELS = (1.0, 1.0, 1.0, 0.631, 1.0, 1.0, 1.0, 0.631, 0.631, 0.631, 0.398, 0.631, 0.631)
CORRECT = (True, True, True, False, True, True, True, True, True, True, False, True, True)
TURNS = {3: True, 6: True, 10: True}
POINTS = tuple(
    StaircasePoint(i, n, c, TURNS.get(i, False)) for i, (n, c) in enumerate(zip(LEVELS, CORRECT, strict=True))
)


def row(trial: int, **changes) -> ClosedTrial:
    point = POINTS[trial]
    plain = ClosedTrial(
        run=5, trial=trial, attempt=0, phase="test", frequency_hz=25.0, level_n=point.level_n,
        shown=1 + trial % 2, answer=1 + trial % 2 if point.correct else 2 - trial % 2, correct=point.correct,
        reversal=point.reversal, response_time_s=2.1, delivered_mps2=4.04, off_axis_mps2=0.8, status="ok", remark="",
    )  # fmt: skip
    return replace(plain, **changes)


def view(**changes) -> WatchView:
    runs = (
        WatchedRun(0, "training", 5.0, "done", 13, 13, 43),
        *(WatchedRun(1 + i, "practice", f, "done", 0, 0, 5) for i, f in enumerate((15.0, 25.0, 35.0, 45.0))),
        WatchedRun(5, "test", 25.0, "present", 3, 13, 13),
        *(WatchedRun(6 + i, "test", f, "to come", 0, 13, 0) for i, f in enumerate((35.0, 5.0, 15.0, 45.0))),
    )
    void = row(12, attempt=0, shown=None, answer=None, correct=None, status="spoiled", remark="the handle was let go")
    lapse = row(9, phase="catch", level_n=3.0, answer=1, correct=False)
    flagged = row(8, status="flagged", remark="leaning on the spring")
    rows = (row(12, attempt=1), void, row(11), row(10), lapse, flagged, *(row(i) for i in range(7, -1, -1)))
    plain = WatchView(
        utc=UTC, session="P01_001", subject="P01", protocol="Force thresholds for telling two directions apart",
        device="omega.3 (serial 1)", simulated=False, observer=None, standing="running", reason="",
        activity="waiting for the answer", activity_s=4.2, runs=runs, shown_run=5, points=POINTS, next_level_n=0.631,
        cap_n=3.0, open_trial=OpenTrial(5, 13, 0, 25.0, 0.631, False, 4.2), last=rows, answers=76,
        exposure=Exposure(31.4, 120.0, 0.43, 2.5), catch_given=1, catch_lapses=1,
        practice=(PracticeLine(15.0, 4, 5, True), PracticeLine(45.0, 3, 5, False)),
        forms=(FormLine("2026-11-22T09:40:00.000+00:00", "consent", True),),
        notes=(NoteLine("2026-11-22T10:01:00.000+00:00", "experimenter", "Asks for a lower chair", False),),
        gate_radius_mm=10.0, live=LIVE, alarms=(),
    )  # fmt: skip
    return replace(plain, **changes)


ALARM = Alarm("sensor", "The acceleration sensor is clipped: it reads too little.", UTC)
ENDED = Alarm("ended", "The sitting ended: the experimenter stopped the session.", UTC)


class Source:
    def __init__(self, first: WatchView | None) -> None:
        self.view = first
        self.problem = ""

    def latest(self) -> WatchView | None:
        return self.view


class Seat:
    """Whoever sits before the screen."""

    def __init__(self, app: WatchApp, clock: VirtualClock, source: Source, asked: list, bells: list) -> None:
        self.app, self.clock, self.source, self.asked, self.bells = app, clock, source, asked, bells
        self.pilot = None

    async def pass_time(self, seconds: float) -> None:
        """Of the alarms' clock; the screen then looks, as it does ten times a second."""
        self.clock.sleep(seconds)
        self.app.screen_stack[1].look()
        await self.pilot.pause()

    @property
    def lines(self) -> list[str]:
        strips = self.app.screen._compositor.render_strips()
        return ["".join(segment.text for segment in strip).rstrip() for strip in strips]

    @property
    def text(self) -> str:
        """Without line breaks and frames."""
        return " ".join(" ".join(self.lines).translate(FRAMES).split())

    async def press(self, *keys: str) -> None:
        await self.pilot.press(*keys)
        await self.pilot.pause()

    async def show(self, shown: WatchView | None) -> None:
        self.source.view = shown
        await self.wait(lambda: self.app.screen_stack[1].view is shown)

    async def wait(self, until, most_s: float = 20.0) -> None:
        end_s = time.monotonic() + most_s
        while not until():
            assert time.monotonic() < end_s, "\n".join(self.lines)
            await asyncio.sleep(0.02)
        await self.pilot.pause()


@pytest.fixture
def seated(monkeypatch):
    """Runs `story(seat)` with the screen at a size."""
    monkeypatch.setenv("TZ", "UTC")
    time.tzset()

    def run(story, first=None, size=(80, 24), theme="hapteq-dark", ask=None) -> Seat:
        source, asked, bells = Source(view() if first is None else first), [], []
        clock = VirtualClock()
        app = WatchApp(source, ask or asked.append, theme, clock.now_s)
        app.bell = lambda: bells.append(clock.now_s())
        seat = Seat(app, clock, source, asked, bells)

        async def told() -> None:
            async with app.run_test(size=size) as pilot:
                seat.pilot = pilot
                await seat.wait(lambda: len(app.screen_stack) > 1 and app.screen_stack[1].view is not None)
                await story(seat)

        asyncio.run(told())
        return seat

    yield run
    monkeypatch.undo()
    time.tzset()


def test_the_screen_says_how_it_stands_and_that_it_only_watches(seated):
    async def story(seat):
        assert seat.lines[0].strip() == "● RUNNING  P01_001  trial 14 at 0.631 N: waiting for the answer, 4 s"
        assert "You only watch: S stops, p pauses, n notes." in seat.lines[1]
        assert "test 1, 25 Hz, 3 of 13 reversals, now 0.631 N" in seat.text
        assert "hidden until it is answered" in seat.text

    seated(story)


@pytest.mark.parametrize("size", [(80, 24), (132, 40)])
@pytest.mark.parametrize("theme", ["hapteq-dark", "hapteq-light"])
@pytest.mark.parametrize("alarms", [(), (ALARM,)])
def test_the_screen_looks_as_it_did(seated, size, theme, alarms):
    """With HAPTEQ_WRITE_SCREENS set the pictures are written anew. Words are the same in every theme."""
    picture = HERE / f"watch_{size[0]}x{size[1]}{'_alarm' if alarms else ''}.txt"

    async def story(seat):
        shown = "\n".join(seat.lines) + "\n"
        if "HAPTEQ_WRITE_SCREENS" in os.environ:
            picture.write_text(shown, "utf-8")
        assert shown == picture.read_text("utf-8")

    seated(story, view(alarms=alarms), size, theme)


@pytest.mark.parametrize("size", [(40, 10), (60, 15), (80, 24), (200, 60)])
def test_no_size_breaks_it(seated, size):
    async def story(seat):
        await seat.press("d", "d")
        assert "P01_001" in seat.text

    seated(story, view(alarms=(ALARM,)), size)


def test_stop_asks_nothing_and_says_when_it_was_heard(seated):
    async def story(seat):
        await seat.press("S")
        assert seat.asked == [STOP]
        assert "Stop sent: the force goes off at once." in seat.lines[1]
        stopped = {"standing": "stopped", "reason": "the experimenter stopped the session", "alarms": (ENDED,)}
        await seat.show(view(open_trial=None, live=None, **stopped))
        assert "■ STOPPED" in seat.lines[0]
        assert "The session has stopped: the experimenter stopped the session." in seat.lines[1]
        assert "ALARM" not in seat.text

    assert seated(story).bells == []


def test_a_small_s_stops_nothing(seated):
    async def story(seat):
        await seat.press("s")

    assert seated(story).asked == []


def test_a_stop_that_is_not_heard_is_an_alarm(seated):
    async def story(seat):
        await seat.press("S")
        await seat.pass_time(UNHEARD_AFTER_S - 0.1)
        assert seat.bells == []
        await seat.pass_time(0.2)
        assert "The session has not answered the stop." in seat.text
        assert "switch the device off" in seat.text

    assert len(seated(story).bells) == 1


def test_a_stop_that_is_not_heard_in_a_pause_is_an_alarm_too(seated):
    """A session hears it there within a moment, and ends."""

    async def story(seat):
        await seat.show(view(standing="paused", activity="pausing", open_trial=None))
        await seat.press("S")
        await seat.pass_time(UNHEARD_AFTER_S + 0.1)
        assert "The session has not answered the stop." in seat.text

    assert len(seated(story).bells) == 1


def test_a_stop_that_cannot_be_sent_says_what_to_do(seated):
    def refuse(_request):
        raise StudyError("t", "The disk is full.", "Switch the device off.")

    async def story(seat):
        await seat.press("S")
        assert "NOT sent: The disk is full. Switch the device off." in seat.lines[1]

    assert seated(story, ask=refuse).bells


def test_pause_is_sent_and_says_who_goes_on(seated):
    async def story(seat):
        await seat.press("p")
        assert "Pause sent. The participant goes on" in seat.lines[1]
        await seat.show(view(standing="paused", activity="pausing", open_trial=None))
        await seat.press("p")
        assert "It is paused already" in seat.lines[1]

    assert seated(story).asked == [PAUSE]


@pytest.mark.parametrize(("key", "adverse"), [("n", False), ("e", True)])
def test_a_note_is_typed_and_sent(seated, key, adverse):
    async def story(seat):
        await seat.press(key)
        assert ("What happened to the participant" in seat.text) is adverse
        await seat.press(*"numb S", "enter")
        assert "Sent: the session writes it into the log." in seat.lines[1]

    assert seated(story).asked == [NoteAsked("experimenter", "numb S", adverse)]


def test_a_note_can_be_left_and_an_empty_one_is_none(seated):
    async def story(seat):
        await seat.press("n", *"abc", "escape")
        await seat.press("n", "space", "enter")
        assert "You only watch" in seat.lines[1]

    assert seated(story).asked == []


def test_a_note_being_typed_does_not_keep_anybody_from_stopping(seated):
    async def story(seat):
        await seat.press("n", *"abc", "f8")
        assert seat.asked == [STOP]

    seated(story)


def test_an_alarm_rings_until_it_is_seen_and_stays_on_the_screen(seated):
    async def story(seat):
        assert seat.bells == []
        await seat.show(view(alarms=(ALARM,)))
        for look in range(9):
            await seat.pass_time(0.3 * RING_EVERY_S)
            await seat.show(view(alarms=(ALARM,), activity_s=float(look)))  # news keep coming
        assert len(seat.bells) == 3
        assert "ALARM: press a when you have seen it" in seat.text
        assert "▲ The acceleration sensor is clipped: it reads too little. since 10:17:00 +00:00" in seat.text
        await seat.press("a")
        assert "1 alarm seen." in seat.lines[1]
        await seat.pass_time(0.3 * RING_EVERY_S)
        await seat.show(view(alarms=(ALARM,)))
        await seat.pass_time(0.8 * RING_EVERY_S - 1.0)
        assert len(seat.bells) == 3
        assert "seen: The acceleration sensor is clipped" in seat.text
        await seat.show(view())
        assert "sensor is clipped" not in seat.text
        await seat.press("a")
        assert "There is no alarm to be seen." in seat.lines[1]

    seated(story)


def test_a_view_that_stands_still_is_an_alarm(seated):
    async def story(seat):
        await seat.pass_time(NO_NEWS_AFTER_S - 0.1)
        assert seat.bells == []
        await seat.pass_time(0.2)
        assert "This view has stood still for seconds" in seat.text

    assert seated(story).bells


def test_a_reader_that_ended_is_an_alarm(seated):
    async def story(seat):
        seat.source.problem = "the program that reads the log has ended."
        await seat.wait(lambda: "This view is not fed any more: the program that reads the log has ended." in seat.text)

    assert seated(story).bells


def test_details_show_forms_practice_and_notes(seated):
    async def story(seat):
        assert "consent" not in seat.text
        await seat.press("d")
        for part in (
            "09:40:00 +00:00 consent: passed",
            "45 Hz: 3 right of 5, NOT passed",
            "Asks for a lower chair",
            "a person",
        ):
            assert part in seat.text
        await seat.press("d")
        assert "Last trials" in seat.text

    seated(story)


def test_a_wide_screen_shows_the_details_beside(seated):
    async def story(seat):
        assert "10:01:00 +00:00 experimenter: Asks" in seat.text
        assert "the handle" in seat.text

    seated(story, size=(132, 40))


def test_help_is_about_this_screen_and_stop_is_in_it(seated):
    async def story(seat):
        await seat.press("f1")
        assert "Watching a session" in seat.text
        assert "The force is off at once" in seat.text
        await seat.press("escape")
        assert "Last trials" in seat.text

    seated(story)


def test_leaving_ends_the_view_and_asks_for_nothing(seated):
    async def story(seat):
        await seat.press("q")

    seat = seated(story)
    assert not seat.app.is_running
    assert seat.asked == []


def test_before_the_first_view_it_says_that_it_opens(monkeypatch):
    async def story() -> None:
        app = WatchApp(Source(None), lambda _request: None)
        async with app.run_test(size=(80, 24)) as pilot:
            await pilot.pause()
            text = "".join(segment.text for strip in app.screen._compositor.render_strips() for segment in strip)
            assert "Opening the session" in text

    asyncio.run(story())


RESTING = {"standing": "resting", "activity": "resting", "activity_s": 65.0, "open_trial": None}
FINISHED = {"standing": "finished", "reason": "all runs are done", "open_trial": None}


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (RESTING, "◌ RESTING P01_001 resting, 1 min 05 s"),
        (FINISHED, "✓ FINISHED P01_001 all runs are done"),
        ({"standing": "not running", "reason": "gone"}, "! NOT RUNNING P01_001 gone"),
        ({"live": replace(LIVE, sensor_clipped=True)}, "3.3 m/s² CLIPPED"),
        ({"live": replace(LIVE, missed_ticks=3)}, "no fault, 3 late ticks"),
        ({"live": replace(LIVE, handle_ready=False, offset_mm=14.0)}, "14.0 mm: OUT of place"),
        ({"live": replace(LIVE, fault="lost")}, "FAULT: lost"),
        ({"live": None}, "Handle not read now"),
        ({"points": (), "shown_run": None}, "Staircase: nothing answered yet"),
        ({"open_trial": OpenTrial(5, 13, 1, 25.0, 3.0, True, 1.0)}, "trial 14, attempt 2 at 3 N, a catch trial"),
    ],
)  # fmt: skip
def test_what_the_screen_says(seated, changes, words):
    async def story(seat):
        assert words in seat.text

    seated(story, view(**changes))


def test_what_was_not_measured_is_a_mark_with_one_explanation(seated):
    async def story(seat):
        assert seat.text.count("n.m. answered too early to measure; counts") == 1
        assert seat.text.count("n.m.") > 3
        assert "unmeasured" not in seat.text

    rows = tuple(replace(trial, status="unmeasured", delivered_mps2=None) for trial in view().last)
    for size in ((80, 24), (132, 40)):
        seated(story, view(last=rows), size)
