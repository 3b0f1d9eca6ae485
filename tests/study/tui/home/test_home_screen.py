"""The start screen: a form that says what is wrong, and a list of whatever lies there."""

from dataclasses import replace

import pytest
from textual.widgets import Input, Select

from study.session.views.archive_views import HomeView, ProtocolLine
from study.tui.screens.home import HomeScreen
from study.tui.widgets.session_table import AT_ONCE, SessionTable


def asked(app) -> list[tuple]:
    return [(type(m).__name__, *vars_of(m)) for m in app.asked]


def vars_of(message) -> list[str]:
    return [getattr(message, name) for name in message.__dataclass_fields__]


@pytest.mark.parametrize("size", [(80, 24), (132, 40)], ids=["80x24", "132x40"])
def test_it_looks_like_this(on_screen, home, looks_like, size):
    async def story(sight):
        looks_like(sight, f"home-{size[0]}x{size[1]}")

    on_screen(HomeScreen(home), story, size)


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


def test_the_list_can_be_asked_for_before_it_is_there(on_screen, home):
    async def story(sight):
        await sight.press("f3")
        sight.app.screen.show(home)
        await sight.pilot.pause()
        await sight.pilot.pause()
        assert isinstance(sight.app.screen.focused, SessionTable)

    on_screen(HomeScreen(None), story)


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


@pytest.mark.parametrize("key", ["enter", "f5"])
def test_a_code_and_a_key_begin_a_session(on_screen, home, key):
    async def story(sight):
        await sight.press("P", "0", "6", key)

    app = on_screen(HomeScreen(home), story)
    assert asked(app) == [("BeginWanted", "P06", "direction_threshold", "simulated", "")]


def test_another_protocol_can_be_chosen_with_the_keyboard(on_screen, home):
    async def story(sight):
        await sight.press("P", "6", "tab", "enter", "down", "enter")
        assert "Practice run at 5 Hz" in sight.text
        await sight.press("f5")

    app = on_screen(HomeScreen(home), story)
    assert asked(app) == [("BeginWanted", "P6", "direction_training", "simulated", "")]


def with_equalized_first(home, *models):
    line = ProtocolLine("equalized_threshold", "Two equal accelerations", False, equalized=True)
    return replace(home, protocols=(line, *home.protocols), models=models)


def test_a_protocol_of_accelerations_asks_for_a_model_and_no_other_does(on_screen, home):
    async def story(sight):
        assert "Model" in sight.text and "centre.h5" in sight.text
        await sight.press("P", "0", "6", "tab", "enter", "down", "enter")
        assert "Model" not in sight.text
        await sight.press("enter", "up", "enter", "f5")

    app = on_screen(HomeScreen(with_equalized_first(home, "/lab/centre.h5", "/lab/edge.h5")), story)
    assert asked(app) == [("BeginWanted", "P06", "equalized_threshold", "simulated", "/lab/centre.h5")]


def test_without_a_model_it_says_where_one_comes_from_and_begins_nothing(on_screen, home):
    async def story(sight):
        await sight.press("P", "0", "6", "f5")
        assert "needs a model beside the data: hapteq record, hapteq identify" in sight.words

    assert on_screen(HomeScreen(with_equalized_first(home)), story).asked == []


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


def test_a_code_with_an_unfinished_session_is_noticed_before_a_second_one_begins(on_screen, home):
    async def story(sight):
        await sight.press("P", "0", "3")
        assert "P03_001 of this protocol is not finished." in sight.words

    on_screen(HomeScreen(home), story)


def test_a_code_that_was_here_before_is_noticed(on_screen, home):
    async def story(sight):
        await sight.press("P", "0", "1")
        assert "P01 has a session here already. Is it the same person?" in sight.words

    on_screen(HomeScreen(home), story)


def test_the_next_free_code_is_proposed(on_screen, home):
    async def story(sight):
        assert "such as P06" in sight.text

    on_screen(HomeScreen(home), story)


def test_a_paste_with_line_breaks_and_blanks_is_one_code(on_screen, home):
    from textual.events import Paste

    async def story(sight):
        sight.app.screen.query_one("#code", Input).post_message(Paste(" P06 \nrm -rf\n"))
        await sight.pilot.pause()
        await sight.press("f5")

    assert asked(on_screen(HomeScreen(home), story)) == [("BeginWanted", "P06", "direction_threshold", "simulated", "")]


@pytest.mark.parametrize(
    ("row", "key", "expected"),
    [
        (0, "enter", ("SessionWanted", "/data/P05_001")),
        (0, "w", ("WatchWanted", "/data/P05_001")),
        (1, "enter", ("SessionWanted", "/data/P04_001")),
        (2, "r", ("ResumeWanted", "/data/P03_001")),
        (4, "enter", ("SessionWanted", "/data/P01_001")),
    ],
)
def test_keys_do_what_the_session_under_the_cursor_allows(on_screen, home, row, key, expected):
    async def story(sight):
        await sight.press("f3", *["down"] * row, key)

    assert asked(on_screen(HomeScreen(home), story)) == [expected]


@pytest.mark.parametrize(("row", "key"), [(0, "r"), (4, "r"), (3, "r"), (2, "w"), (1, "w")])
def test_what_it_does_not_allow_asks_for_nothing(on_screen, home, row, key):
    async def story(sight):
        await sight.press("f3", *["down"] * row, key)

    assert on_screen(HomeScreen(home), story).asked == []


@pytest.mark.parametrize(("row", "offered"), [(0, {"Watch"}), (1, set()), (2, {"Resume"}), (3, set()), (4, set())])
def test_keys_that_do_nothing_for_the_session_under_the_cursor_are_not_named(on_screen, home, row, offered):
    async def story(sight):
        await sight.press("f3", *["down"] * row)
        assert {"Resume", "Watch"}.intersection(sight.lines[-1].split()) == offered

    on_screen(HomeScreen(home), story)


def test_the_session_under_the_cursor_is_told_in_a_sentence(on_screen, home):
    async def story(sight):
        await sight.press("f3", "down")
        assert "P04_001 cannot be read. Line 7 of events.jsonl" in sight.words
        await sight.press("down")
        assert "P03_001 is not finished: 2 of 6 runs done, 101 answers. It can be resumed." in sight.words

    on_screen(HomeScreen(home), story)


def test_standings_are_told_by_symbol_and_word(on_screen, home):
    async def story(sight):
        for standing in ("▶ running", "! unreadable", "◐ unfinished", "✕ withdrawn", "✓ finished"):
            assert standing in sight.text

    on_screen(HomeScreen(home), story)


def test_f6_looks_again_and_keeps_what_is_typed_chosen_and_under_the_cursor(on_screen, home, line):
    async def story(sight):
        await sight.press("P", "9", "tab", "enter", "down", "enter", "f3", "down", "down", "f6")
        newer = replace(line, name="P07_001", path="/data/P07_001", subject="P07")
        sight.app.screen.show(replace(home, sessions=(newer, *home.sessions)))
        await sight.pilot.pause()
        screen = sight.app.screen
        assert screen.query_one("#code", Input).value == "P9"
        assert screen.query_one("#protocol", Select).value == "direction_training"
        assert screen.query_one(SessionTable).cursor_row == 3
        assert "P03_001 is not finished" in sight.words

    assert asked(on_screen(HomeScreen(home), story)) == [("HomeWanted",)]


def test_five_hundred_sessions_open_at_once_and_scroll_to_the_last(on_screen, home, line):
    many = tuple(replace(line, name=f"P{n:03}_001", path=f"/data/P{n:03}_001", subject=f"P{n:03}") for n in range(500))

    async def story(sight):
        sight.app.screen.show(replace(home, sessions=many))
        table = sight.app.screen.query_one(SessionTable)
        assert table.row_count == AT_ONCE
        await sight.until(lambda: table.row_count == len(many))
        await sight.press("f3", "ctrl+end", "enter")
        assert "P499_001" in sight.text

    assert asked(on_screen(HomeScreen(None), story))[-1] == ("SessionWanted", "/data/P499_001")


def test_a_newer_list_replaces_a_long_one_that_still_comes_in(on_screen, home, line):
    many = tuple(replace(line, name=f"P{n:03}_001") for n in range(300))

    async def story(sight):
        sight.app.screen.show(replace(home, sessions=many))
        sight.app.screen.show(home)
        table = sight.app.screen.query_one(SessionTable)
        await sight.until(lambda: table.row_count == len(home.sessions))
        await sight.pilot.pause(0.3)
        assert table.row_count == len(home.sessions)

    on_screen(HomeScreen(None), story)


def test_weird_data_is_shown_as_text(on_screen, line):
    weird = replace(
        line, name="[red]X1_001", subject="X1", protocol="[/]" + "長" * 60, begun_utc="yesterday", observer="[b]x",
        standing="unfinished", runs_done=99,
    )  # fmt: skip
    home = HomeView(
        "[bold]data", (weird,), (ProtocolLine("/a/b/[x].toml", "[/] Cannot be used", False),), ("omega[3]",)
    )

    async def story(sight):
        assert "[red]X1_001" in sight.text
        assert "[bold]data" in sight.text
        assert "[/]長長" in sight.text
        assert "[/] Cannot be used" in sight.text

    on_screen(HomeScreen(home), story)


def test_without_protocols_nothing_can_be_begun(on_screen, home):
    async def story(sight):
        await sight.press("P", "1", "f5", "enter")

    assert on_screen(HomeScreen(replace(home, protocols=())), story).asked == []


@pytest.mark.parametrize("theme", ["hapteq-dark", "hapteq-light", "hapteq-contrast"])
@pytest.mark.parametrize("size", [(40, 12), (200, 60)], ids=["tiny", "wide"])
def test_it_stands_any_size_and_theme(on_screen, home, size, theme):
    async def story(sight):
        assert "New session" in sight.text

    on_screen(HomeScreen(home), story, size, theme)


def test_help_is_one_key_away_also_while_typing(on_screen, home):
    async def story(sight):
        await sight.press("P", "f1")
        assert "1 to 16 letters" in sight.words
        await sight.press("escape")
        assert "New session" in sight.text

    on_screen(HomeScreen(home), story)


@pytest.mark.parametrize("width", [80, 100, 120, 200])
def test_no_column_of_the_list_is_cut(on_screen, home, width):
    lines = tuple(replace(line, name=f"PARTICIPANT0{line.name}") for line in home.sessions)
    long = replace(lines[0], protocol="equalized_threshold_of_our_laboratory", begun_utc="2026-02-05T10:02:00+00:00")

    async def story(sight):
        table = sight.app.screen.query_one(SessionTable)
        assert table.virtual_size.width <= table.size.width
        await sight.until(lambda: "PARTICIPANT0P01_001" in sight.text)
        for column in table.columns.values():
            assert column.width >= len(str(column.label))
        header, *below = sight.lines[table.region.y :]
        place = header.index("Protocol", table.region.x)
        assert "".join(line[place:].strip("│ ") for line in below).startswith(long.protocol)

    on_screen(HomeScreen(replace(home, sessions=(long, *lines[1:]))), story, (width, 40))
