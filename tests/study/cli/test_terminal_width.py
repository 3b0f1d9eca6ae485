"""What commands list fits a terminal of the usual widths, and nothing of it is cut."""

import shutil
from collections import Counter

import pytest

from study.cli.main import main
from tests.slow_instances import slow_after

WIDTHS = (80, 100, 120, 200)
COMMANDS = {
    "sessions": ("sessions", "--data", "{data}"),
    "show": ("show", "P01_001", "--data", "{data}"),
    "watch": ("watch", "P01_001", "--data", "{data}", "--once"),
}


@pytest.fixture(scope="module")
def data(tmp_path_factory, brief_text, sketching):
    """Two sessions, one of a protocol with a long name."""
    folder = tmp_path_factory.mktemp("width")
    long = "a_protocol_of_a_name_that_fills_a_line_of_sixty_three_characters"[:63]
    for code, name in (("P01", "small"), ("PARTICIPANT00002", long)):
        text = "\n".join(f'name = "{name}"' if line.startswith("name = ") else line for line in brief_text.splitlines())
        (folder / f"{name}.toml").write_text(text)
        with sketching():
            assert main(["study", "--protocol", str(folder / f"{name}.toml"), "--observer", "ideal", "--seed", "3",
                         "--subject", code, "--data", str(folder / "data")]) == 0  # fmt: skip
    return folder / "data"


@pytest.fixture
def said(data, capsys, monkeypatch):
    def call(command: str, width: int | None) -> str:
        monkeypatch.setattr(f"study.cli.{command}.read_terminal_width", lambda: width)
        capsys.readouterr()
        assert main([part.format(data=data) for part in COMMANDS[command]]) == 0
        return capsys.readouterr().out

    return call


@pytest.mark.parametrize("width", slow_after(1, WIDTHS))
@pytest.mark.parametrize("command", COMMANDS)
def test_everything_is_there_at_each_width(said, command, width):
    whole, shown = said(command, None), said(command, width)
    assert Counter("".join(shown.split())) == Counter("".join(whole.split()))


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("command", ["sessions", "watch"])
def test_no_line_is_longer_than_the_terminal(said, command, width):
    assert max(map(len, said(command, width).splitlines())) <= width


def test_the_offset_stands_in_the_header_alone(said):
    header, *rows = said("sessions", 80).splitlines()
    assert "begun (" in header and not any("+00:00" in row or "+01:00" in row for row in rows)


def test_a_terminal_says_how_wide_it_is_and_a_pipe_does_not(monkeypatch):
    from study.cli.screen import read_terminal_width

    monkeypatch.setattr("shutil.get_terminal_size", lambda: shutil.os.terminal_size((93, 20)))
    monkeypatch.setattr("sys.stdout.isatty", lambda: True, raising=False)
    assert read_terminal_width() == 93
    monkeypatch.setattr("sys.stdout.isatty", lambda: False, raising=False)
    assert read_terminal_width() is None
