"""Asking for a diagnosis, and waiting for it."""

import pytest
from textual.widgets import Input, ProgressBar

from study.tui.screens.diagnose_form import DiagnoseForm
from study.tui.screens.diagnosing import DiagnosingScreen
from study.tui.screens.home import HomeScreen
from study.tui.screens.session import SessionScreen


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "rec one.h5").write_text("")
    (tmp_path / "two.h5").write_text("")
    (tmp_path / "model.toml").write_text("")
    return tmp_path


def filled(on_screen, folder, sources, model="", out="", *keys, clean=""):
    seen = []

    async def story(sight):
        for name, text in (("sources", sources), ("model", model), ("out", out), ("clean", clean)):
            sight.app.screen.query_one(f"#{name}", Input).value = text
        for key in keys or ("f5",):
            await sight.press(key)
        seen.append(sight.words)

    app = on_screen(DiagnoseForm(), story, (100, 30))
    return [each.command for each in app.asked], seen[0]


@pytest.mark.parametrize("key", ["f5", "enter"])
def test_recordings_a_model_and_a_folder_are_asked_for(on_screen, folder, key):
    sources = f"'{folder}/rec one.h5' {folder}/two.h5"
    (asked,), _ = filled(on_screen, folder, sources, f"{folder}/model.toml", f"{folder}/out", key)
    assert asked.sources == (f"{folder}/rec one.h5", f"{folder}/two.h5")
    assert (asked.model, asked.out) == (f"{folder}/model.toml", f"{folder}/out")


def test_model_and_folder_may_be_left_to_the_program(on_screen, folder):
    (asked,), _ = filled(on_screen, folder, f"{folder}/two.h5")
    assert (asked.model, asked.out, asked.clean) == ("", "", ())


def test_recordings_of_the_device_in_order_may_be_named(on_screen, folder):
    (asked,), _ = filled(on_screen, folder, f"{folder}/two.h5", clean=f"'{folder}/rec one.h5'")
    assert asked.clean == (f"{folder}/rec one.h5",)


@pytest.mark.parametrize(("clean", "said"), [("old.h5", "There is nothing at old.h5."), ("'x", "A quotation mark")])
def test_wrong_ones_are_reported(on_screen, folder, clean, said):
    asked, words = filled(on_screen, folder, f"{folder}/two.h5", clean=clean)
    assert asked == []
    assert said in words


@pytest.mark.parametrize(
    ("sources", "model", "said"),
    [
        ("", "", "Name a recording, or the folder of a session."),
        ("nowhere.h5", "", "There is nothing at nowhere.h5."),
        ("'open", "", "A quotation mark is open."),
        ("{0}/two.h5", "{0}", "There is no file"),
        ("~no_such_user/rec.h5", "", "There is nothing at ~no_such_user/rec.h5."),
        ("x" * 300, "", "There is nothing at xxx"),
        ("{0}/two.h5", "~no_such_user/model.toml", "There is no file ~no_such_user/model.toml."),
        ("{0}/two.h5", "x" * 300, "There is no file xxx"),
    ],
)
def test_what_is_wrong_is_reported_before_anything_begins(on_screen, folder, sources, model, said):
    asked, words = filled(on_screen, folder, sources.format(folder), model.format(folder))
    assert asked == []
    assert said in words


@pytest.mark.slow
def test_escape_leaves_the_form_and_f1_explains_it(on_screen, home):
    async def story(sight):
        await sight.press("f8")
        assert "Diagnose: what does a model lack?" in sight.text
        await sight.press("f1")
        assert "Where does a recording differ from a model" in sight.words
        await sight.press("escape", "escape")
        assert "New session" in sight.text

    on_screen(HomeScreen(home), story)


def test_a_session_is_offered_to_be_diagnosed_by_itself(on_screen, session):
    async def story(sight):
        await sight.press("d")
        assert sight.app.screen.query_one("#sources", Input).value == "/data/P01_001"
        assert sight.app.focused.id == "model"

    on_screen(SessionScreen(session), story)


@pytest.mark.parametrize("size", [(80, 24), (132, 40)], ids=["80x24", "132x40"])
def test_the_form_looks_like_this(on_screen, looks_like, size):
    async def story(sight):
        looks_like(sight, f"diagnose-{size[0]}x{size[1]}")

    on_screen(DiagnoseForm(), story, size)


@pytest.mark.parametrize("size", [(80, 24), (132, 40)], ids=["80x24", "132x40"])
def test_while_it_is_computed_it_looks_like_this(on_screen, looks_like, size):
    async def story(sight):
        sight.app.screen.show_progress("looking for the first effect", 0.4)
        await sight.pilot.pause()
        assert sight.app.screen.query_one(ProgressBar).percentage == pytest.approx(0.4)
        looks_like(sight, f"diagnosing-{size[0]}x{size[1]}")

    on_screen(DiagnosingScreen("Getting ready.", lambda: 0.0), story, size)


@pytest.mark.slow
def test_escape_stops_it(on_screen, home):
    stopped = []

    async def story(sight):
        sight.app.push_screen(DiagnosingScreen("Getting ready."), stopped.append)
        await sight.pilot.pause()
        await sight.press("escape")

    on_screen(HomeScreen(home), story)
    assert stopped == [True]
