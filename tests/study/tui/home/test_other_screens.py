"""The diagnosis, opening a file, the wait for the device."""

import re
from dataclasses import replace

import pytest
from textual.widgets import Input

from protocols.wording.words import Words
from study.tui.screens.browse import BrowseScreen
from study.tui.screens.diagnosis import DiagnosisScreen
from study.tui.screens.home import HomeScreen
from study.tui.screens.preparing import PreparingScreen, describe_elapsed
from tests.study.tui.home.conftest import messages_of


@pytest.mark.slow
@pytest.mark.parametrize("size", [(80, 24), (132, 40)], ids=["80x24", "132x40"])
def test_a_diagnosis_looks_like_this(on_screen, diagnosis, looks_like, size):
    async def story(sight):
        looks_like(sight, f"diagnosis-{size[0]}x{size[1]}")

    on_screen(DiagnosisScreen(diagnosis), story, size)


def test_a_long_path_of_a_diagnosis_is_shown_to_its_end(on_screen, diagnosis):
    path = "/home/lab/studies/pilot with older participants/data 2026/diagnosis of friday/diagnosis.json"

    async def story(sight):
        assert path in sight.words

    on_screen(DiagnosisScreen(replace(diagnosis, path=path)), story)


@pytest.mark.slow
def test_a_diagnosis_can_be_scrolled_to_what_remains(on_screen, diagnosis):
    async def story(sight):
        await sight.press("end")
        assert "What remains" in sight.text

    on_screen(DiagnosisScreen(diagnosis), story)


@pytest.mark.slow
def test_its_report_opens_in_the_browser_and_escape_goes_home(on_screen, diagnosis):
    async def story(sight):
        await sight.press("o", "escape")

    app = on_screen(DiagnosisScreen(diagnosis), story)
    assert app.opened == ["file:///data/out/report.html"]
    assert [type(m).__name__ for m in app.asked] == ["HomeRequested"]
    assert on_screen(DiagnosisScreen(replace(diagnosis, report="")), story).opened == []


def test_agreement_is_reported_where_there_is_nothing_else(on_screen, diagnosis):
    nothing = replace(
        diagnosis, sentences=(), rivals=(), mismatch=(), fit=(), remainder=(), next_experiment="", notes=()
    )

    async def story(sight):
        for sentence in (
            "No effect is named.",
            "None beyond what repeats allow.",
            "No further recording is suggested.",
        ):
            assert sentence in sight.words

    on_screen(DiagnosisScreen(nothing), story, (100, 40))


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "P01_001").mkdir()
    (tmp_path / "P01_001" / "events.jsonl").write_text("")
    (tmp_path / "diagnosis.json").write_text("{}")
    (tmp_path / "holiday.jpg").write_text("")
    (tmp_path / ".hidden").mkdir()
    return tmp_path


def browse(on_screen, folder, *keys, typed=None):
    seen = []

    async def story(sight):
        await sight.until(lambda: "P01_001" in sight.text)
        seen.append(sight.text)
        if typed is not None:
            sight.app.screen.query_one("#path", Input).focus()
            sight.app.screen.query_one("#path", Input).value = str(typed)
        for key in keys:
            await sight.press(key)
            await sight.pilot.pause(0.1)
        seen.append(sight.text)

    app = on_screen(BrowseScreen(str(folder)), story, (100, 30))
    return messages_of(app), seen


def test_only_folders_and_our_files_are_offered(on_screen, folder):
    _, (text, _) = browse(on_screen, folder)
    assert "P01_001" in text
    assert "diagnosis.json" in text
    assert "holiday" not in text
    assert ".hidden" not in text


@pytest.mark.slow
def test_a_diagnosis_is_picked_with_the_keyboard(on_screen, folder):
    asked, _ = browse(on_screen, folder, "end", "enter")
    assert asked == [("ShowDiagnosis", str(folder / "diagnosis.json"))]


@pytest.mark.parametrize("what", ["P01_001", "P01_001/events.jsonl"])
def test_a_session_is_opened_by_its_folder_or_its_log(on_screen, folder, what):
    asked, _ = browse(on_screen, folder, "enter", typed=f" {folder / what} ")
    assert asked == [("ShowSession", str(folder / "P01_001"))]


@pytest.mark.parametrize("typed", ["nowhere", "/" + "x" * 300, "~no_such_user/data"])
def test_a_path_that_is_not_there_is_reported(on_screen, folder, typed):
    asked, (_, text) = browse(on_screen, folder, "enter", typed=typed)
    assert asked == []
    assert "There is nothing at" in text


@pytest.mark.slow
def test_f4_opens_it_from_the_start_and_escape_comes_back(on_screen, home):
    async def story(sight):
        await sight.press("f4")
        assert "Open a session or a diagnosis" in sight.text
        await sight.press("f1")
        assert "hapteq show PATH" in sight.words
        await sight.press("escape", "escape")
        assert "New session" in sight.text

    on_screen(HomeScreen(home), story)


def test_while_the_device_is_prepared_it_says_what_and_for_how_long(on_screen, monkeypatch):
    now = [100.0]
    monkeypatch.setattr("study.tui.screens.preparing.UPDATE_INTERVAL_S", 0.02)

    async def story(sight):
        assert "Compiling the simulation." in sight.text
        assert "0 s so far" in sight.text
        now[0] += 75.0
        await sight.until(lambda: "1 min 15 s so far" in sight.text)
        sight.app.screen.show_step("Opening the log.")
        await sight.pilot.pause()
        assert "Opening the log." in sight.text
        assert "1 min 15 s so far" in sight.text

    on_screen(PreparingScreen("Compiling the simulation.", lambda: now[0]), story)


def test_before_the_language_is_known_nothing_is_said(on_screen):
    german = Words({"preparing_title": "Einen Moment", "key_help": "Hilfe", "elapsed_s": "bisher {seconds} s"})

    async def story(sight):
        assert re.findall(r"[A-Za-z]{2,}", sight.text) == []
        sight.app.screen.set_language(german)
        await sight.pilot.pause()
        assert re.findall(r"[A-Za-z]{2,}", sight.text) == []
        sight.app.screen.show_step("Das Gerät wird vorbereitet.")
        await sight.until(lambda: "bisher 0 s" in sight.text)
        assert "Einen Moment" in sight.text
        assert "Hilfe" in sight.text
        assert "Help" not in sight.text

    on_screen(PreparingScreen(""), story)


def test_elapsed_time_counts_whole_seconds():
    assert [describe_elapsed(s) for s in (0.0, 59.9, 60.0, 3601.0)] == [
        "0 s so far", "59 s so far", "1 min 0 s so far", "60 min 1 s so far"
    ]  # fmt: skip
