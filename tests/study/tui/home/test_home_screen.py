"""The start screen's form: code, protocol, device, and what is wrong with them."""

from dataclasses import replace

import pytest
from textual.widgets import Input, Select

from study.session.views.archive_views import ProtocolLine
from study.tui.screens.home import HomeScreen
from study.tui.widgets.session_table import SessionTable
from tests.slow_instances import slow_after
from tests.study.tui.home.conftest import messages_of


@pytest.mark.slow
@pytest.mark.parametrize("size", [(80, 24), (132, 40)], ids=["80x24", "132x40"])
def test_it_looks_like_this(on_screen, home, looks_like, size):
    async def story(sight):
        looks_like(sight, f"home-{size[0]}x{size[1]}")

    on_screen(HomeScreen(home), story, size)


@pytest.mark.slow
def test_the_first_frame_is_there_before_the_sessions(on_screen, home):
    async def story(sight):
        assert "Looking for sessions…" in sight.text
        assert "Participant" in sight.text
        await sight.press("P", "0", "6")
        sight.app.screen.show(home)
        await sight.pilot.pause()
        assert "Looking for" not in sight.text
        assert "P03_001" in sight.text
        assert sight.app.screen.query_one("#code", Input).value == "P06"

    on_screen(HomeScreen(None), story)


@pytest.mark.slow
def test_the_list_can_be_asked_for_before_it_is_there(on_screen, home):
    async def story(sight):
        await sight.press("f3")
        sight.app.screen.show(home)
        await sight.pilot.pause()
        await sight.pilot.pause()
        assert isinstance(sight.app.screen.focused, SessionTable)

    on_screen(HomeScreen(None), story)


@pytest.mark.slow
def test_only_a_protocol_and_a_device_can_be_chosen(on_screen, home):
    async def story(sight):
        for select in sight.app.screen.query("#protocol, #device").results(Select):
            assert not any(value in ("", Select.NULL) for _, value in select._options)

    on_screen(HomeScreen(home), story)


def test_a_new_lab_is_told_what_to_do_first(on_screen, home, looks_like):
    async def story(sight):
        looks_like(sight, "home-empty-80x24")
        assert "hapteq rehearse" in sight.text
        await sight.press("f3")
        assert sight.app.screen.focused.id == "empty"

    on_screen(HomeScreen(replace(home, sessions=())), story)


@pytest.mark.slow
@pytest.mark.parametrize("key", ["enter", "f5"])
def test_a_code_and_a_key_begin_a_session(on_screen, home, key):
    async def story(sight):
        await sight.press("P", "0", "6", key)

    app = on_screen(HomeScreen(home), story)
    assert messages_of(app) == [("BeginRequested", "P06", "direction_threshold", "simulated", "")]


@pytest.mark.slow
def test_another_protocol_can_be_chosen_with_the_keyboard(on_screen, home):
    async def story(sight):
        await sight.press("P", "6", "tab", "enter", "down", "enter")
        assert "Practice run at 5 Hz" in sight.text
        await sight.press("f5")

    app = on_screen(HomeScreen(home), story)
    assert messages_of(app) == [("BeginRequested", "P6", "direction_training", "simulated", "")]


def with_equalized_first(home, *models):
    line = ProtocolLine("equalized_threshold", "Two equal accelerations", False, equalized=True)
    return replace(home, protocols=(line, *home.protocols), models=models)


@pytest.mark.slow
def test_a_protocol_of_accelerations_asks_for_a_model_and_no_other_does(on_screen, home):
    async def story(sight):
        assert "Model" in sight.text and "centre.h5" in sight.text
        await sight.press("P", "0", "6", "tab", "enter", "down", "enter")
        assert "Model" not in sight.text
        await sight.press("enter", "up", "enter", "f5")

    app = on_screen(HomeScreen(with_equalized_first(home, "/lab/centre.h5", "/lab/edge.h5")), story)
    assert messages_of(app) == [("BeginRequested", "P06", "equalized_threshold", "simulated", "/lab/centre.h5")]


@pytest.mark.parametrize("name", ["[bold]centre.h5", "centre[x='y].h5", "centre\x1b[2J\n.h5"])
def test_the_name_of_a_models_file_is_no_markup_and_prints_no_control_character(on_screen, home, name):
    shown = name.replace("\x1b", " ").replace("\n", " ")

    async def story(sight):
        await sight.until(lambda: shown in sight.text)
        await sight.press("P", "0", "6", "f5")

    app = on_screen(HomeScreen(with_equalized_first(home, f"/lab/{name}")), story)
    assert messages_of(app) == [("BeginRequested", "P06", "equalized_threshold", "simulated", f"/lab/{name}")]


@pytest.mark.slow
def test_without_a_model_it_says_where_one_comes_from_and_begins_nothing(on_screen, home):
    async def story(sight):
        await sight.press("P", "0", "6", "f5")
        assert "needs a model, next to the data: hapteq record, hapteq identify" in sight.words

    assert on_screen(HomeScreen(with_equalized_first(home)), story).asked == []


@pytest.mark.slow
@pytest.mark.parametrize(
    ("typed", "said"),
    [
        ("ada", "'ada' is no participant code; a code has 1 to 16 letters and digits"),
        ("", "A code is needed"),
        ("P02", "P02 withdrew: this code is not given again."),
    ],
)
def test_a_wrong_code_begins_nothing_and_says_why(on_screen, home, typed, said):
    async def story(sight):
        await sight.press(*typed, "f5")
        assert said in sight.words

    assert on_screen(HomeScreen(home), story).asked == []


@pytest.mark.slow
def test_a_code_with_an_unfinished_session_is_noticed_before_a_second_one_begins(on_screen, home):
    async def story(sight):
        await sight.press("P", "0", "3")
        assert "P03_001 of this protocol is not finished." in sight.words

    on_screen(HomeScreen(home), story)


@pytest.mark.slow
def test_a_code_that_was_here_before_is_noticed(on_screen, home):
    async def story(sight):
        await sight.press("P", "0", "1")
        assert "P01 has a session here already. Is it the same person?" in sight.words

    on_screen(HomeScreen(home), story)


@pytest.mark.slow
def test_the_next_free_code_is_proposed(on_screen, home):
    async def story(sight):
        assert "such as P06" in sight.text

    on_screen(HomeScreen(home), story)


@pytest.mark.slow
def test_a_paste_with_line_breaks_and_blanks_is_one_code(on_screen, home):
    from textual.events import Paste

    async def story(sight):
        sight.app.screen.query_one("#code", Input).post_message(Paste(" P06 \nrm -rf\n"))
        await sight.pilot.pause()
        await sight.press("f5")

    assert messages_of(on_screen(HomeScreen(home), story)) == [
        ("BeginRequested", "P06", "direction_threshold", "simulated", "")
    ]


@pytest.mark.slow
def test_without_protocols_nothing_can_be_begun(on_screen, home):
    async def story(sight):
        await sight.press("P", "1", "f5", "enter")

    assert on_screen(HomeScreen(replace(home, protocols=())), story).asked == []


@pytest.mark.parametrize("theme", slow_after(1, ["hapteq-dark", "hapteq-light", "hapteq-contrast"]))
@pytest.mark.parametrize("size", [(40, 12), (200, 60)], ids=["tiny", "wide"])
def test_it_stands_any_size_and_theme(on_screen, home, size, theme):
    async def story(sight):
        assert "New session" in sight.text

    on_screen(HomeScreen(home), story, size, theme)


def test_a_long_path_of_the_data_folder_is_shown_to_its_end(on_screen, home):
    async def story(sight):
        assert "/home/lab/studies/pilot with older participants/data 2026" in sight.words

    path = "/home/lab/studies/pilot with older participants/data 2026"
    on_screen(HomeScreen(replace(home, data=path)), story)


@pytest.mark.slow
def test_help_is_one_key_away_also_while_typing(on_screen, home):
    async def story(sight):
        await sight.press("P", "f1")
        assert "1 to 16 letters" in sight.words
        await sight.press("escape")
        assert "New session" in sight.text

    on_screen(HomeScreen(home), story)
