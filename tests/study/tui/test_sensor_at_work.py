"""Six positions of a board on a pseudo-terminal, by keys, with the engine at work: done, stopped, refused."""

import asyncio
import contextlib
import time

import numpy as np
import pytest

from study.devices.accelerometer.calibration import GRAVITY_MPS2, POSITIONS, UP_DIRECTIONS
from study.devices.force_dimension.lab import read_lab_settings
from study.tui.app.app import HapteqApp
from study.tui.app.start_options import StartOptions
from tests.study.devices.accelerometer.pty_board import SCALE, Board

pytestmark = [pytest.mark.real_time, pytest.mark.may_be_late, pytest.mark.timeout(180)]


class Person:
    def __init__(self, app, pilot):
        self.app, self.pilot = app, pilot

    @property
    def text(self):
        strips = self.app.screen._compositor.render_strips()
        return " ".join(" ".join("".join(segment.text for segment in strip) for strip in strips).split())

    async def until(self, screen, words, patience_s=60.0):
        until_s = time.monotonic() + patience_s
        while type(self.app.screen).__name__ != screen or words not in self.text:
            assert time.monotonic() < until_s, f"at {self.app.screen}: {self.text}"
            await self.pilot.pause(0.05)

    async def opens(self, port):
        await self.until("HomeScreen", "Participant")
        await self.pilot.press("f7", *port, "f5")


def run(data, story):
    app = HapteqApp(StartOptions(str(data), "simulated"))

    async def play():
        async with app.run_test(size=(100, 34)) as pilot:
            await story(Person(app, pilot))

    try:
        asyncio.run(play())
    finally:
        app.close_engine()


@pytest.fixture
def lab_file(tmp_path, monkeypatch):
    monkeypatch.setenv("HAPTEQ_DEVICE_FILE", str(tmp_path / "device.toml"))
    return tmp_path / "device.toml"


@pytest.mark.slow
def test_by_keys_from_the_start_screen_to_the_lab_s_file(tmp_path, lab_file):
    with contextlib.closing(Board(2000.0)) as board:

        async def story(person):
            await person.opens(board.path)
            for number, (position, up) in enumerate(zip(POSITIONS, UP_DIRECTIONS, strict=True), 1):
                await person.until("SensorScreen", f"{number} of 6: lay the sensor down with {position}")
                board.acceleration = GRAVITY_MPS2 * up
                await person.pilot.press("enter")
            await person.until("SensorScreen", "Enter writes this into")
            assert not lab_file.exists()
            await person.pilot.press("enter")
            await person.until("SensorScreen", "Written into")

        run(tmp_path / "data", story)
    sensor = read_lab_settings().accelerometer
    assert sensor is not None and sensor.port == board.path
    np.testing.assert_allclose(sensor.sensitivity, SCALE * np.eye(3), atol=0.5)
    np.testing.assert_allclose(sensor.bias, 32_768, atol=2)


@pytest.mark.slow
def test_esc_stops_it_and_the_port_is_free_again(tmp_path, lab_file):
    with contextlib.closing(Board(2000.0)) as board:

        async def story(person):
            for _ in range(2):
                await person.opens(board.path)
                await person.until("SensorScreen", "1 of 6")
                await person.pilot.press("escape")
                await person.until("OutcomeScreen", "The calibration was stopped")
                assert "Nothing was written." in person.text
                await person.pilot.press("enter")

        run(tmp_path / "data", story)
    assert not lab_file.exists()


def test_a_port_that_is_not_there_is_told_and_it_can_be_tried_again(tmp_path, lab_file):
    async def story(person):
        await person.opens("/nowhere/tty7")
        await person.until("OutcomeScreen", "The accelerometer cannot be opened")
        await person.pilot.press("enter")
        await person.until("SensorScreen", "F5 begins again.")

    run(tmp_path / "data", story)
