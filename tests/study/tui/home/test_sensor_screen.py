"""Six positions at the screen: what is asked, what is sent, what is refused."""

import pytest
from textual.widgets import Input

from study.tui.engine.from_engine import CalibrationComputed, CalibrationStored, PlacementRequest
from study.tui.screens.home import HomeScreen
from study.tui.screens.sensor import SensorScreen
from tests.study.tui.home.conftest import messages_of


def story_of(*steps):
    """Each step: what the engine says, or keys."""
    seen = []

    async def story(sight):
        for step in steps:
            if isinstance(step, PlacementRequest | CalibrationComputed | CalibrationStored):
                sight.app.screen.handle_message(step)
                await sight.pilot.pause()
            else:
                await sight.press(*step)
            seen.append(sight.words)

    return story, seen


PORT = tuple("COM3")


def test_a_person_is_led_through_six_positions(on_screen):
    story, seen = story_of(
        PORT,
        ("f5",),
        PlacementRequest(1, "+x up", None),
        ("enter",),
        PlacementRequest(2, "-x up", (38_652.4, 32_768.0, 32_768.0)),
        ("enter", "enter"),
        CalibrationComputed('[accelerometer]\nport = "COM3"', "/lab/device.toml"),
        ("enter", "enter"),
        CalibrationStored("/lab/device.toml"),
    )
    app = on_screen(SensorScreen(), story, (90, 30))
    assert "The port is opened" in seen[1]
    assert "1 of 6: lay the sensor down with +x up, let go of it, press Enter." in seen[2]
    assert "+x up: listening, leave it at rest" in seen[3]
    assert "+x up: ✓ read 38652, 32768, 32768" in seen[4] and "2 of 6" in seen[4]
    assert "Enter writes this into /lab/device.toml" in seen[6] and '[accelerometer] port = "COM3"' in seen[6]
    assert "It is written…" in seen[7] and "Written into /lab/device.toml" in seen[8]
    # A second Enter while it listens, or while it is written, does nothing.
    assert messages_of(app) == [
        ("CalibrateSensor", "COM3", 2_000_000),
        ("Reply", 1, True),
        ("Reply", 2, True),
        ("StoreCalibration", '[accelerometer]\nport = "COM3"'),
    ]


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        (("f5",), "Name the port."),
        ((*PORT, "tab", *"fast", "f5"), "The baud rate is a whole number."),
        ((*PORT, "tab", "0", "f5"), "The baud rate is a whole number."),
        ((*PORT, "tab", *"2147483648", "f5"), "It has at most 9 digits."),
    ],
)
def test_what_cannot_be_meant_is_refused(on_screen, keys, said):
    story, seen = story_of(keys)
    app = on_screen(SensorScreen(), story)
    assert said in seen[0] and app.asked == []


@pytest.mark.slow
def test_esc_stops_it_and_goes_back(on_screen, home):
    story, seen = story_of(("f7",), (*PORT, "enter"), PlacementRequest(1, "+x up", None), ("escape",))
    app = on_screen(HomeScreen(home), story, (132, 40))
    assert "1 of 6" in seen[2] and "Sessions" in seen[3]
    assert [name for name, *_ in messages_of(app)] == ["CalibrateSensor", "Interrupt"]


def test_after_an_error_it_begins_again(on_screen):
    async def story(sight):
        await sight.press(*PORT, "f5")
        screen = sight.app.screen
        assert screen.query_one("#port", Input).disabled
        screen.reset_after_error()
        await sight.pilot.pause()
        assert "F5 begins again." in sight.words and not screen.query_one("#port", Input).disabled
        await sight.press("f5")

    assert len(on_screen(SensorScreen(), story).asked) == 2
