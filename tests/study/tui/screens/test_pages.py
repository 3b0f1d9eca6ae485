"""Pages that are read and left, and waits that the application ends."""

import subprocess
import sys

import pytest

from study.errors import StudyError
from study.session.views.participant_views import (
    DemoDone,
    DemoMenu,
    DeviceFinding,
    DeviceReport,
    DirectionPicture,
    Goodbye,
    HandleView,
    PlayDemo,
    PlayingNotice,
    PracticeResult,
    RestNotice,
    Welcome,
)
from study.tui.app.outcomes import make_failure_outcome
from study.tui.engine.from_engine import Failed
from study.tui.keys.answer_keys import parse_keys
from study.tui.screens.await_return import AwaitReturnScreen
from study.tui.screens.demo import DemoScreen
from study.tui.screens.device_check import DeviceCheckScreen
from study.tui.screens.goodbye import GoodbyeScreen
from study.tui.screens.handle import HandleScreen
from study.tui.screens.instructions import InstructionsScreen
from study.tui.screens.outcome import OutcomeScreen
from study.tui.screens.playing import PlayingScreen
from study.tui.screens.practice_over import PracticeOverScreen
from study.tui.screens.rest import RestScreen
from study.tui.trial_replies import LEAVING, PAUSE

PICTURE = DirectionPicture("yz", (135.0, 45.0))
MENU = DemoMenu(PICTURE, 3, 2, ((2, 1),), handle_moves=True)
FINE = DeviceFinding("Loop", "4000 ticks", fine=True, advice="not to be shown")
BAD = DeviceFinding("Sensor", "silent", fine=False, advice="Plug it in.")


@pytest.fixture
def read(on_stage):
    """Presses keys on a page; returns what was heard, and the words that were on it before."""

    def page(screen, *keys):
        seen = []

        async def story(stage):
            seen.append(stage.words)
            for key in keys:
                await stage.press(key)

        return on_stage(screen, story), seen[0]

    return page


@pytest.mark.parametrize(
    "screen",
    [
        lambda: InstructionsScreen(Welcome("T", PICTURE, 5, 1, "d", device_moves=True, resumed_after=0)),
        pytest.param(lambda: PracticeOverScreen(PracticeResult(True, 8, 10)), marks=pytest.mark.slow),
        lambda: AwaitReturnScreen("reason"),
        lambda: GoodbyeScreen(Goodbye(True, 5)),
    ],
    ids=["instructions", "practice over", "await return", "goodbye"],
)
def test_enter_and_no_other_key_leaves_a_page(read, screen):
    assert read(screen(), "x", "space", "1")[0] == []
    assert read(screen(), "enter")[0] == [None]


def test_instructions_say_what_happens_and_that_nothing_can_go_wrong(read):
    words = read(InstructionsScreen(Welcome("T", PICTURE, 5, 1, "d", device_moves=True, resumed_after=0)))[1]
    for part in (
        "press 1 or 2",
        "if you cannot tell, guess. A guess can do no harm.",
        "then 5 runs",
        "press p for a pause",
    ):
        assert part in words
    assert "Practice:" not in words and "Welcome back" not in words


def test_instructions_tell_practice_resumption_and_other_keys(read):
    welcome = Welcome("T", PICTURE, 5, 0, "the simulation", device_moves=False, resumed_after=12)
    words = read(InstructionsScreen(welcome, parse_keys("f,j")))[1]
    assert "Welcome back: 12 answers are on the disk." in words
    assert "Practice: the device is a simulation (the simulation)" in words
    assert "press f for 1, j for 2" in words


def test_a_practice_that_went_badly_is_no_failure(read):
    assert "That is enough to go on." in read(PracticeOverScreen(PracticeResult(True, 8, 10)))[1]
    words = read(PracticeOverScreen(PracticeResult(False, 3, 10)))[1]
    assert "3 of the last 10 answers were right." in words and "hard to tell for everyone" in words


def test_the_end_says_what_is_saved_and_why_it_ended(read):
    assert "1 answer is on the disk." in read(GoodbyeScreen(Goodbye(True, 1)))[1]
    words = read(GoodbyeScreen(Goodbye(False, 7, "the device is gone")))[1]
    assert "The session stops here: the device is gone." in words and "7 answers are on the disk." in words


def test_the_end_can_be_read_and_left_in_a_small_window(on_stage):
    error = StudyError("Interrupted", "It ended. " * 30, "Do this. " * 30 + "Last.", "Saved. " * 30)

    async def story(stage):
        assert "Q Leave" in stage.words
        await stage.press("end")
        assert "Last." in stage.words

    on_stage(OutcomeScreen(make_failure_outcome(Failed(error, "/data/P01_001"), at_home=False)), story, (60, 20))


def test_a_void_trial_is_explained(read):
    assert "It is void: the handle was gone." in read(AwaitReturnScreen("the handle was gone"))[1]
    busy = read(AwaitReturnScreen("12.0 % of the 1 kHz ticks were missed"))[1]
    assert "The computer was too busy for a moment" in busy and "This was not your fault" in busy


def test_a_device_check_with_a_warning_continues_by_enter_and_shows_what_to_do(read):
    late = DeviceFinding("Lateness", "too late for a real device", fine=False, advice="Close others.", warning=True)
    heard, words = read(DeviceCheckScreen(DeviceReport("d", True, (FINE, late))), "g", "enter")
    assert heard == [True]
    assert "warn Lateness too late for a real device" in words and "Close others." in words
    assert "The device is ready; mind the warning above. Press Enter to go on." in words


def test_a_device_that_is_fine_continues_by_enter(read):
    heard, words = read(DeviceCheckScreen(DeviceReport("d", True, (FINE,))), "g", "enter")
    assert heard == [True]
    assert "ok Loop 4000 ticks" in words and "not to be shown" not in words and "nothing moves" in words


@pytest.mark.slow
def test_a_device_that_needs_a_look_is_not_passed_by_enter(read):
    heard, words = read(DeviceCheckScreen(DeviceReport("d", False, (FINE, BAD))), "enter")
    assert heard == []
    assert "LOOK Sensor silent Plug it in." in words
    assert read(DeviceCheckScreen(DeviceReport("d", False, (BAD,))), "g")[0] == [True]
    assert read(DeviceCheckScreen(DeviceReport("d", False, (BAD,))), "c")[0] == [False]


@pytest.mark.parametrize(
    ("keys", "choice"),
    [
        ("1", PlayDemo(2, 1)),
        ("2", PlayDemo(2, 2)),
        (("right", "1"), PlayDemo(3, 1)),
        (("n", "n", "2"), PlayDemo(3, 2)),
        (("b", "left", "2"), PlayDemo(1, 2)),
        (("enter", "enter"), DemoDone()),
        (("enter", "1"), PlayDemo(2, 1)),
    ],
)
def test_the_demonstration_plays_turns_and_ends(read, keys, choice):
    assert read(DemoScreen(MENU), *keys)[0] == [choice]


def test_enter_by_habit_does_not_skip_the_demonstration(on_stage):
    async def story(stage):
        await stage.press("enter")
        assert "5 of 6 were not felt yet: ← and → lead there. Enter again goes on." in stage.text

    assert on_stage(DemoScreen(MENU), story) == []


def test_once_all_was_felt_enter_continues(read):
    everything = tuple((vibration, number) for vibration in (1, 2, 3) for number in (1, 2))
    assert read(DemoScreen(DemoMenu(PICTURE, 3, 3, everything, True)), "enter")[0] == [DemoDone()]


def test_the_demonstration_plays_by_keys_of_ones_own(read):
    assert read(DemoScreen(MENU, parse_keys("f,j")), "j")[0] == [PlayDemo(2, 2)]


def test_the_demonstration_marks_what_was_felt_and_where_its_ends_are(on_stage):
    async def story(stage):
        assert "vibration 2 of 3" in stage.words and "[2 ✓·]" in stage.text and "1 felt" in stage.words
        assert "nothing moves" not in stage.words
        await stage.press("right")
        assert "Nothing of it was felt yet." in stage.words and "1 felt" not in stage.words
        await stage.press("right")
        assert "This is the fastest vibration." in stage.words
        await stage.press("left")
        assert "Felt so far: 1." in stage.words
        await stage.press("left", "left")
        assert "This is the slowest vibration." in stage.words

    on_stage(DemoScreen(MENU), story)


def test_a_demonstration_that_moves_nothing_says_so(read):
    assert "The device is a simulation: nothing moves." in read(DemoScreen(DemoMenu(PICTURE, 3, 1, (), False)))[1]


def test_a_pause_can_be_asked_for_in_a_demonstration(read):
    (message,) = read(DemoScreen(MENU), "p")[0]
    assert isinstance(message, DemoScreen.PauseWanted)


@pytest.mark.parametrize(("key", "reply"), [("p", PAUSE), ("q", LEAVING)])
@pytest.mark.parametrize(
    "screen",
    [
        lambda: PlayingScreen(PlayingNotice("Interval 1", 1, 2.0, None)),
        lambda: HandleScreen(HandleView(False, "Move it.", (5.0, 5.0), 8.0)),
    ],
    ids=["playing", "handle"],
)
def test_every_wait_can_be_paused(read, screen, key, reply):
    assert read(screen(), "1", "enter", key)[0] == [reply]


def test_a_wait_that_the_application_closes_has_no_reply(on_stage):
    screen = PlayingScreen(PlayingNotice("Direction 1", 1, 2.0, PICTURE))

    async def story(stage):
        assert "1 now" in stage.words and "2 now" not in stage.words
        screen.dismiss(None)

    assert on_stage(screen, story) == [None]


def test_in_the_gap_between_two_intervals_nothing_is_marked(read):
    words = read(PlayingScreen(PlayingNotice("", 1, 0.5, None)))[1]
    assert "now" not in words


def test_the_spot_follows_the_handle_and_stays_in_sight(on_stage):
    screen = HandleScreen(HandleView(False, "Move it left.", (20.0, 0.0), 8.0))

    async def story(stage):
        far = stage.text
        screen.update_view(HandleView(False, "Move it up.", (0.0, -3.0), 8.0))
        await stage.pilot.pause()
        assert "Move it up." in stage.words and stage.text != far
        screen.update_view(HandleView(False, "Move it left.", (1e6, 0.0), 8.0))
        await stage.pilot.pause()
        assert stage.text == far

    on_stage(screen, story)


def test_a_rest_cannot_be_shortened_and_tells_what_is_left(on_stage):
    async def story(stage):
        assert "1 run is left." in stage.words and "0:01" not in stage.words
        await stage.press("enter", "space", "escape")
        assert stage.heard == []
        assert "There is no hurry." in stage.words
        await stage.reads("When you are ready, press Enter.")
        await stage.press("enter")

    (rested_s,) = on_stage(RestScreen(RestNotice(0.6, 1)), story)
    assert 0.6 <= rested_s < 10.0


@pytest.mark.slow
def test_screens_load_nothing_heavy():
    code = (
        "import sys, importlib\n"
        "for name in ('trial','form','demo','playing','handle','rest','pause','instructions','device_check'):\n"
        "    importlib.import_module('study.tui.screens.' + name)\n"
        "print([m for m in ('numpy','pydantic','h5py','scipy','study.store','study.devices') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
