"""Every screen of a participant as text at two sizes, and the trial as a picture in both themes."""

import pytest
from textual.widgets._footer import FooterKey

from protocols.trial import Phase
from study.session.views.form_views import Form, FormField, FormKind
from study.session.views.participant_views import (
    DemoMenu,
    DeviceFinding,
    DeviceReport,
    DirectionPicture,
    Goodbye,
    HandleView,
    PauseNotice,
    PlayingNotice,
    PracticeResult,
    Progress,
    Question,
    RestNotice,
    Task,
    Welcome,
)
from study.tui.screens.await_return import AwaitReturnScreen
from study.tui.screens.confirm_view import ConfirmView
from study.tui.screens.confirm_withdrawal import ConfirmWithdrawal
from study.tui.screens.demo import DemoScreen
from study.tui.screens.device_check import DeviceCheckScreen
from study.tui.screens.form import FormScreen
from study.tui.screens.goodbye import GoodbyeScreen
from study.tui.screens.handle import HandleScreen
from study.tui.screens.instructions import InstructionsScreen
from study.tui.screens.note import NoteScreen
from study.tui.screens.pause import PauseScreen
from study.tui.screens.playing import PlayingScreen
from study.tui.screens.practice_over import PracticeOverScreen
from study.tui.screens.rest import RestScreen
from study.tui.screens.trial import TrialScreen
from tests.slow_instances import slow, slow_rows

SIZES = ((80, 24), (132, 40))
PICTURE = DirectionPicture("yz", (135.0, 45.0))
QUESTION = Question(Phase.TEST, 2, 5, 7, False, 0.0, PICTURE, progress=Progress(0.42, 12))
INTERVAL = Question(Phase.DETECTION, 1, 5, 3, True, 0.0, PICTURE, task=Task.INTERVAL, progress=Progress(0.1, None))
YES_NO = ("yes", "no")
CONSENT = Form(
    FormKind.CONSENT,
    "Consent",
    "Please read each statement. The study begins only if you agree to all of them.",
    tuple(
        FormField(f"statement_{i}", f"Statement {i}: I know what is done here, and may stop at any time.", YES_NO)
        for i in range(1, 9)
    ),
    "2",
    "EC 2026-17",
)
HEARING = ("ear plugs", "ear muffs", "masking noise", "plugs and noise", "nothing of these")
SETUP = Form(
    FormKind.SETUP,
    "How you sit",
    "Arrange these with the experimenter.",
    (
        FormField("hearing", "What covers the sound?", HEARING),
        FormField("strategy", "How did you decide?", needed=False),
    ),
)  # fmt: skip
REPORT = DeviceReport(
    "omega.3",
    simulated=False,
    findings=(
        DeviceFinding("Loop", "4000 ticks in 1 s, zero force held to the end", fine=True),
        DeviceFinding("Missed ticks", "31 of 4000", fine=False, advice="Close other programs."),
    ),
)


def armed(question):
    screen = TrialScreen()
    screen.arm(question)
    return screen


SCREENS = {
    "trial": lambda: armed(QUESTION),
    "trial_interval": lambda: armed(INTERVAL),
    "form_consent": lambda: FormScreen(CONSENT),
    "form_setup": lambda: FormScreen(SETUP),
    "device_check": lambda: DeviceCheckScreen(REPORT),
    "instructions": lambda: InstructionsScreen(Welcome("A study", PICTURE, 5, 1, "simulated omega.3", False, 0)),
    "demo": lambda: DemoScreen(DemoMenu(PICTURE, 5, 2, ((1, 1), (1, 2), (2, 1)), handle_moves=False)),
    "playing": lambda: PlayingScreen(PlayingNotice("Direction 2", 2, 2.0, PICTURE)),
    "playing_interval": lambda: PlayingScreen(PlayingNotice("Interval 1", 1, 2.0, None)),
    "handle": lambda: HandleScreen(HandleView(False, "Bring the handle 12 mm back.", (11.0, 5.0), 8.0)),
    "practice_over": lambda: PracticeOverScreen(PracticeResult(False, 6, 10)),
    "rest": lambda: RestScreen(RestNotice(75.0, 3, Progress(0.4, 14))),
    "pause": lambda: PauseScreen(PauseNotice("asked for a pause", 37)),
    "await_return": lambda: AwaitReturnScreen("no answer within the time limit"),
    "goodbye": lambda: GoodbyeScreen(Goodbye(False, 37, "the participant left")),
    "note": lambda: NoteScreen(adverse=True),
    "confirm_withdrawal": lambda: ConfirmWithdrawal(),
    "confirm_view": lambda: ConfirmView("P01_001"),
}  # fmt: skip


NARROW, WIDE = SIZES
LAID_OUT_BY_WIDTH = ("trial", "form_consent", "instructions", "rest")
"""At the larger size too, in the quick tests."""


@pytest.mark.parametrize(
    ("name", "size"),
    [
        *((name, NARROW) for name in SCREENS),
        *((name, WIDE) for name in LAID_OUT_BY_WIDTH),
        *slow_rows(*((name, WIDE) for name in SCREENS if name not in LAID_OUT_BY_WIDTH)),
    ],
    ids=lambda each: each if isinstance(each, str) else f"{each[0]}x{each[1]}",
)
def test_a_screen_reads_as_it_did_and_tells_of_its_help(on_stage, same_as_before, name, size):
    async def story(stage):
        assert "Help" in stage.text.splitlines()[-1]
        same_as_before(f"{name}_{size[0]}x{size[1]}.txt", stage.text)

    on_stage(SCREENS[name](), story, size)


@pytest.mark.parametrize("theme", ["dark", "light"])
@pytest.mark.parametrize("size", SIZES, ids=lambda size: f"{size[0]}x{size[1]}")
def test_the_trial_looks_as_it_did(on_stage, same_as_before, size, theme):
    async def story(stage):
        same_as_before(f"trial_{size[0]}x{size[1]}_{theme}.svg", stage.svg)

    on_stage(armed(QUESTION), story, size, f"hapteq-{theme}")


@pytest.mark.parametrize("name", SCREENS)
def test_every_screen_has_help(name):
    screen = SCREENS[name]()
    assert 3 <= len([line for line in screen.HELP.splitlines() if line.startswith("- ")]) <= 8


TINY, HUGE = (40, 12), (200, 60)


@pytest.mark.parametrize(
    ("name", "size"),
    [
        ("trial", TINY), ("handle", HUGE), ("form_consent", TINY),
        *slow_rows(
            ("trial", HUGE), ("handle", TINY), ("form_consent", HUGE),
            ("trial_interval", TINY), ("trial_interval", HUGE),
        ),
    ],
)  # fmt: skip
def test_a_screen_survives_any_size_and_a_resize(on_stage, name, size):
    async def story(stage):
        await stage.pilot.resize_terminal(*size)
        await stage.pilot.pause()
        assert stage.text.strip()

    on_stage(SCREENS[name](), story)


@pytest.mark.parametrize(
    "name",
    ["rest", "await_return", *slow("form_consent", "form_setup", "device_check", "pause", "confirm_view", "note")],
)
def test_every_key_that_a_footer_names_does_something(on_stage, name):
    named = []

    async def names(stage):
        named.extend(key.key for key in stage.app.screen.query(FooterKey))

    on_stage(SCREENS[name](), names)
    assert named
    for key in named:

        async def story(stage, key=key):
            before = stage.text
            await stage.press(key)
            assert stage.heard or stage.app.screen is not stage.app.first or stage.text != before, key

        on_stage(SCREENS[name](), story)
