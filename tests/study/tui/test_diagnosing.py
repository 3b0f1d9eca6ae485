"""A diagnosis from the start screen, with the engine at work: begun, stopped, refused."""

import asyncio
import time
from pathlib import Path

import pytest

from study.store.formats.mechanical_model_file import write_mechanical_model
from study.store.formats.recording_file import write_recording
from study.tui.app.app import HapteqApp
from study.tui.app.start_options import StartOptions
from study.tui.engine.to_engine import Diagnose
from study.tui.home_messages import DiagnoseRequested

pytestmark = [pytest.mark.real_time, pytest.mark.may_be_late]


@pytest.fixture
def files(module_at, tmp_path):
    made = module_at(Path(__file__).parents[2] / "diagnosed.py")
    write_recording(tmp_path / "rec.h5", made.recorded(1))
    write_mechanical_model(tmp_path / "one.toml", made.device(1))
    write_mechanical_model(tmp_path / "three.toml", made.device(3))
    return tmp_path


class SittingOptions:
    def __init__(self, app, pilot):
        self.app, self.pilot = app, pilot

    @property
    def text(self):
        strips = self.app.screen._compositor.render_strips()
        return " ".join(" ".join("".join(segment.text for segment in strip) for strip in strips).split())

    async def until(self, screen, words="", patience_s=60.0):
        until_s = time.monotonic() + patience_s
        while type(self.app.screen).__name__ != screen or words not in self.text:
            assert time.monotonic() < until_s, f"at {self.app.screen}: {self.text}"
            await self.pilot.pause(0.05)


def run(data, story):
    app = HapteqApp(StartOptions(str(data), "simulated"))

    async def play():
        async with app.run_test(size=(100, 30)) as pilot:
            await story(SittingOptions(app, pilot))

    try:
        asyncio.run(play())
    finally:
        app.close_engine()


@pytest.mark.timeout(120)
def test_esc_stops_it_and_nothing_is_written(files):
    async def story(sitter):
        await sitter.until("HomeScreen")
        sitter.app.post_message(
            DiagnoseRequested(Diagnose((str(files / "rec.h5"),), str(files / "one.toml"), str(files / "out")))
        )
        await sitter.until("DiagnosingScreen", "e-tuning")
        await sitter.pilot.press("escape")
        await sitter.until("OutcomeScreen", "The diagnosis was stopped")
        assert "Nothing was written." in sitter.text
        await sitter.pilot.press("enter")
        await sitter.until("HomeScreen")

    run(files / "data", story)
    assert sorted(path.name for path in files.iterdir()) == ["one.toml", "rec.h5", "three.toml"]


@pytest.mark.slow
@pytest.mark.timeout(120)
def test_what_cannot_be_diagnosed_is_reported_on_a_panel(files):
    async def story(sitter):
        await sitter.until("HomeScreen")
        sitter.app.post_message(DiagnoseRequested(Diagnose((str(files / "rec.h5"),), str(files / "three.toml"), "")))
        await sitter.until("OutcomeScreen", "Model and recording do not belong together")
        assert "DiagnosingScreen" not in [type(screen).__name__ for screen in sitter.app.screen_stack]

    run(files / "data", story)
