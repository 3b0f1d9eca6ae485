"""A past session: its pages, and what can be asked for."""

from dataclasses import replace

import pytest
from textual.widgets import TabbedContent

from study.tui.screens.session import SessionScreen, make_file_url
from study.tui.widgets.long_text import LongText
from tests.study.tui.home.conftest import messages_of


@pytest.fixture
def asked_by(on_screen):
    def run(view, *keys):
        async def story(sight):
            await sight.press(*keys)

        return messages_of(on_screen(SessionScreen(view), story))

    return run


def standing(view, standing, **changes):
    return replace(view, line=replace(view.line, standing=standing, **changes))


@pytest.mark.slow
@pytest.mark.parametrize("size", [(80, 24), (132, 40)], ids=["80x24", "132x40"])
def test_each_page_looks_like_this(on_screen, session, looks_like, size):
    async def story(sight):
        for page in "12345":
            await sight.press(page)
            looks_like(sight, f"session-{page}-{size[0]}x{size[1]}")

    on_screen(SessionScreen(session), story, size)


@pytest.mark.slow
def test_keys_ask_for_what_a_finished_session_allows(asked_by, session):
    assert asked_by(session, "r", "w", "a") == [("Analyze", "/data/P01_001")]
    assert asked_by(session, "escape") == [("HomeRequested",)]


@pytest.mark.slow
def test_an_unfinished_session_can_be_resumed(asked_by, session):
    assert asked_by(standing(session, "unfinished"), "r") == [("ResumeRequested", "/data/P01_001")]


@pytest.mark.slow
def test_a_running_session_can_be_watched_and_not_erased(asked_by, session):
    assert asked_by(standing(session, "running"), "x", "P", "0", "1", "enter", "r", "a", "w") == [
        ("WatchRequested", "/data/P01_001")
    ]


@pytest.mark.parametrize("gone", ["withdrawn", "unreadable"])
def test_nothing_is_analyzed_where_nothing_can_be_read(asked_by, session, gone):
    assert asked_by(standing(session, gone), "r", "a", "w") == []


def test_withdrawal_takes_the_typed_code(asked_by, session):
    assert asked_by(session, "x", "P", "0", "1", "enter") == [("Withdraw", "/data/P01_001")]


@pytest.mark.parametrize("keys", [("P", "0", "2", "enter"), ("enter",), ("P", "0", "1", "escape")])
def test_anything_else_erases_nothing(asked_by, session, keys):
    assert asked_by(session, "x", *keys) == []


def test_a_wrong_code_says_that_nothing_was_erased(on_screen, session):
    async def story(sight):
        await sight.press("x", "n", "o", "enter")
        assert "That is not P01. Nothing was erased." in sight.text
        await sight.press("f1")
        assert "tombstone" in sight.words

    on_screen(SessionScreen(session), story)


@pytest.mark.slow
def test_the_report_opens_in_the_browser_where_there_is_one(on_screen, session):
    async def story(sight):
        await sight.press("o")

    assert on_screen(SessionScreen(session), story).opened == ["file:///data/P01_001/analysis/report.html"]
    assert on_screen(SessionScreen(replace(session, report="")), story).opened == []


def test_a_report_that_was_removed_is_reported_where_the_screen_is_in_a_browser(on_screen, session, monkeypatch):
    told = []

    async def story(sight):
        monkeypatch.setattr(type(sight.app), "is_web", True)
        monkeypatch.setattr(type(sight.app), "notify", lambda app, text, **how: told.append(f"{how['title']}: {text}"))
        await sight.press("o")

    assert on_screen(SessionScreen(session), story).opened == []
    (sentence,) = told
    assert sentence.startswith("The report cannot be opened: No such file or directory: /data/P01_001/")


def test_a_path_with_blanks_is_a_url_that_a_browser_understands():
    assert make_file_url("/data/my study/report.html") == "file:///data/my%20study/report.html"


@pytest.mark.slow
def test_a_newer_view_stays_on_its_page(on_screen, session):
    async def story(sight):
        await sight.press("5")
        assert "No report was written yet." in sight.text
        sight.app.screen.show(session)
        await sight.until(lambda: "Open report" in sight.text)
        assert "report.html" in sight.text
        assert sight.app.screen.query_one(TabbedContent).active == "report"
        assert "Open report" in sight.text

    on_screen(SessionScreen(replace(session, report="", figures=())), story)


@pytest.mark.slow
def test_right_and_wrong_and_turns_are_told_by_shape(on_screen, session):
    async def story(sight):
        await sight.press("3")
        for mark in ("○ right", "× wrong", "▼ peak", "▲ valley"):
            assert mark in sight.text
        drawing = "\n".join(sight.lines[5:])
        assert all(mark in drawing for mark in "○×▼▲")

    on_screen(SessionScreen(session), story)


@pytest.mark.slow
def test_a_long_log_scrolls_to_its_end(on_screen, session):
    events = tuple(f"09:30:{n % 60:02}  Line {n} of the log, which is as long as a line may be, and then longer still."
                   for n in range(2000))  # fmt: skip

    async def story(sight):
        await sight.press("4", "end")
        assert "Line 1999 of the log" in sight.text
        await sight.press("home")
        assert "Line 0 of the log" in sight.text
        assert isinstance(sight.app.screen.focused, LongText)

    on_screen(SessionScreen(replace(session, events=events)), story)


@pytest.mark.slow
def test_what_is_broken_off_a_line_stands_below_its_text(on_screen, session):
    async def story(sight):
        await sight.press("4")
        first = next(n for n, text in enumerate(sight.lines) if "09:30:12" in text)
        assert sight.lines[first + 1].startswith(" " * 11 + "word")

    view = replace(session, events=("09:30:12  " + "word " * 20,))
    on_screen(SessionScreen(view), story)


@pytest.mark.slow
def test_an_empty_session_says_so_on_each_page(on_screen, session):
    view = replace(session, facts=(), thresholds=(), warnings=(), staircases=(), events=(), report="", figures=())

    async def story(sight):
        said = {"1": "Nothing stands out.", "2": "there is no threshold yet", "3": "No run has an answer yet.",
                "4": "Nothing can be read.", "5": "No report was written yet."}  # fmt: skip
        for page, sentence in said.items():
            await sight.press(page)
            assert sentence in sight.words

    on_screen(SessionScreen(view), story)


@pytest.mark.slow
def test_markup_in_notes_and_warnings_is_text(on_screen, session):
    view = replace(session, warnings=("[/red] oops [b]",), events=("[/] note", "\x1b[2J"), facts=(("[x]", "[/y]"),))

    async def story(sight):
        assert "[/red] oops [b]" in sight.text
        assert "[/y]" in sight.text
        await sight.press("4")
        assert "[/] note" in sight.text

    on_screen(SessionScreen(view), story)


@pytest.mark.slow
@pytest.mark.parametrize("theme", ["hapteq-dark", "hapteq-light", "hapteq-contrast"])
def test_it_stands_a_small_window_in_every_theme(on_screen, session, theme):
    async def story(sight):
        for page in "12345":
            await sight.press(page)
        assert "P01_001" in sight.text

    on_screen(SessionScreen(session), story, (40, 12), theme)
