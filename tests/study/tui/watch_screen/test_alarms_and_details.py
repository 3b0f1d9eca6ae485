"""The screen of one who watches: alarms, details, help, and leaving."""

import asyncio
import re
from dataclasses import replace

import pytest

from study.session.watching.watch_view import (
    OpenTrial,
)
from study.tui.screens.watch_help import HELP
from study.tui.watch.watch_app import WatchApp
from study.tui.watch.watch_screen import BELL_INTERVAL_S, STALE_AFTER_S, WatchScreen
from tests.study.tui.watch_screen.watched import ALARM, LIVE, Source, view


def test_an_alarm_rings_until_it_is_seen_and_stays_on_the_screen(seated):
    async def story(seat):
        assert seat.bells == []
        await seat.show(view(alarms=(ALARM,)))
        for look in range(9):
            await seat.pass_time(0.3 * BELL_INTERVAL_S)
            await seat.show(view(alarms=(ALARM,), activity_s=float(look)))  # news keep coming
        assert len(seat.bells) == 3
        assert "ALARM: press a when you have seen it" in seat.text
        assert "▲ The acceleration sensor is clipped: it reads too little. since 10:17:00 +00:00" in seat.text
        await seat.press("a")
        assert "1 alarm seen." in seat.lines[1]
        await seat.pass_time(0.3 * BELL_INTERVAL_S)
        await seat.show(view(alarms=(ALARM,)))
        await seat.pass_time(0.8 * BELL_INTERVAL_S - 1.0)
        assert len(seat.bells) == 3
        assert "seen: The acceleration sensor is clipped" in seat.text
        await seat.show(view())
        assert "sensor is clipped" not in seat.text
        await seat.press("a")
        assert "There is no alarm to be seen." in seat.lines[1]

    seated(story)


def test_a_view_that_stands_still_is_an_alarm(seated):
    async def story(seat):
        await seat.pass_time(STALE_AFTER_S - 0.1)
        assert seat.bells == []
        await seat.pass_time(0.2)
        assert "This view has not been updated for seconds" in seat.text

    assert seated(story).bells


def test_a_reader_that_ended_is_an_alarm(seated):
    async def story(seat):
        seat.source.problem = "the program that reads the log has ended."
        await seat.wait(
            lambda: "This view receives no more data: the program that reads the log has ended." in seat.text
        )

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


def test_the_screen_has_every_key_that_its_help_names(seated):
    """Not only in the application of its own: the view opens in that of the participant, too."""
    named = {key.lower() if len(key) > 1 else key for key in re.findall(r"\*\*(F?\w)\*\*", HELP)}
    assert named
    assert named <= {key for binding in WatchScreen.BINDINGS for key in binding.key.split(",")}

    async def story(seat):
        await seat.press("t")
        assert seat.app.theme == "hapteq-light"

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
        ({"live": replace(LIVE, missed_ticks=3)}, "Device 3 missed ticks"),
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
        assert seat.text.count("n.m. answered too early, or see remark; counts") == 1
        assert seat.text.count("n.m.") > 3
        assert "unmeasured" not in seat.text

    rows = tuple(replace(trial, status="unmeasured", delivered_mps2=None) for trial in view().last)
    for size in ((80, 24), (132, 40)):
        seated(story, view(last=rows), size)
