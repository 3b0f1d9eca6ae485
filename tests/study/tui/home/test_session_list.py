"""The start screen's list of sessions: keys by row, refresh, long lists, widths."""

from dataclasses import replace

import pytest
from textual.widgets import Input, Select

from study.session.views.archive_views import HomeView, ProtocolLine
from study.tui.screens.home import HomeScreen
from study.tui.widgets.session_table import BATCH_ROWS, SessionTable
from tests.slow_instances import slow, slow_rows
from tests.study.tui.home.conftest import messages_of


@pytest.mark.slow
@pytest.mark.parametrize(
    ("row", "key", "expected"),
    [
        (0, "enter", ("ShowSession", "/data/P05_001")),
        (0, "w", ("WatchRequested", "/data/P05_001")),
        (1, "enter", ("ShowSession", "/data/P04_001")),
        (2, "r", ("ResumeRequested", "/data/P03_001")),
        (4, "enter", ("ShowSession", "/data/P01_001")),
    ],
)
def test_keys_do_what_the_session_under_the_cursor_allows(on_screen, home, row, key, expected):
    async def story(sight):
        await sight.press("f3", *["down"] * row, key)

    assert messages_of(on_screen(HomeScreen(home), story)) == [expected]


@pytest.mark.slow
@pytest.mark.parametrize(("row", "key"), [(0, "r"), (4, "r"), (3, "r"), (2, "w"), (1, "w")])
def test_what_it_does_not_allow_asks_for_nothing(on_screen, home, row, key):
    async def story(sight):
        await sight.press("f3", *["down"] * row, key)

    assert on_screen(HomeScreen(home), story).asked == []


@pytest.mark.parametrize(
    ("row", "offered"), [(0, {"Watch"}), *slow_rows((1, set()), (2, {"Resume"}), (3, set()), (4, set()))]
)
def test_keys_that_do_nothing_for_the_session_under_the_cursor_are_not_named(on_screen, home, row, offered):
    async def story(sight):
        await sight.press("f3", *["down"] * row)
        assert {"Resume", "Watch"}.intersection(sight.lines[-1].split()) == offered

    on_screen(HomeScreen(home), story)


@pytest.mark.slow
def test_the_session_under_the_cursor_is_reported_in_a_sentence(on_screen, home):
    async def story(sight):
        await sight.press("f3", "down")
        assert "P04_001 cannot be read. Line 7 of events.jsonl" in sight.words
        await sight.press("down")
        assert "P03_001 is not finished: 2 of 6 runs done, 101 answers. It can be resumed." in sight.words

    on_screen(HomeScreen(home), story)


@pytest.mark.slow
def test_standings_are_told_by_symbol_and_word(on_screen, home):
    async def story(sight):
        for standing in ("▶ running", "! unreadable", "◐ unfinished", "✕ withdrawn", "✓ finished"):
            assert standing in sight.text

    on_screen(HomeScreen(home), story)


@pytest.mark.slow
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

    assert messages_of(on_screen(HomeScreen(home), story)) == [("HomeRequested",)]


@pytest.mark.slow
def test_five_hundred_sessions_open_at_once_and_scroll_to_the_last(on_screen, home, line):
    many = tuple(replace(line, name=f"P{n:03}_001", path=f"/data/P{n:03}_001", subject=f"P{n:03}") for n in range(500))

    async def story(sight):
        sight.app.screen.show(replace(home, sessions=many))
        table = sight.app.screen.query_one(SessionTable)
        assert table.row_count == BATCH_ROWS
        await sight.until(lambda: table.row_count == len(many))
        await sight.press("f3", "ctrl+end", "enter")
        assert "P499_001" in sight.text

    assert messages_of(on_screen(HomeScreen(None), story))[-1] == ("ShowSession", "/data/P499_001")


@pytest.mark.slow
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


@pytest.mark.slow
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


@pytest.mark.parametrize("width", [100, *slow(80, 120, 200)])
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


def test_the_device_of_an_unfinished_session_is_named_before_it_is_resumed(on_screen, home):
    unfinished = replace(home.sessions[2], device="omega.3")

    async def story(sight):
        await sight.press("f3")
        assert "It can be resumed on the omega.3." in " ".join(sight.text.split())

    on_screen(HomeScreen(replace(home, sessions=(unfinished,))), story, (110, 40))
