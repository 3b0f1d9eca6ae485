"""Who gets a screen, who line mode, and who a simulated participant."""

import io

import pytest

from study.cli import screen


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.fixture
def streams(monkeypatch):
    def set_up(stdin: io.StringIO | None, stderr: io.StringIO, term: str = "xterm") -> tuple[bool, bool]:
        monkeypatch.setattr("sys.stdin", stdin)
        monkeypatch.setattr("sys.stderr", stderr)
        monkeypatch.setenv("TERM", term)
        monkeypatch.delenv("TEXTUAL_DRIVER", raising=False)
        return screen.has_keyboard(), screen.has_screen()

    return set_up


def test_a_terminal_gets_a_screen(streams):
    assert streams(Terminal(), Terminal()) == (True, True)


def test_a_terminal_that_cannot_draw_gets_line_mode(streams):
    assert streams(Terminal(), Terminal(), term="dumb") == (True, False)
    assert streams(Terminal(), io.StringIO()) == (True, False)


def test_a_pipe_has_neither(streams):
    assert streams(io.StringIO(), Terminal()) == (False, False)
    assert streams(None, Terminal()) == (False, False)


def test_a_browser_has_a_screen_without_a_terminal(streams, monkeypatch):
    streams(None, io.StringIO())
    monkeypatch.setenv("TEXTUAL_DRIVER", "textual.drivers.web_driver:WebDriver")
    assert screen.has_screen()
