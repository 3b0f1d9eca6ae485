"""What `hapteq record` says and asks before a real device moves."""

import io
import os
import pty
import select

import pytest

from study.cli.progress import late_bar
from study.cli.record import announce

NOTICE = "No person may hold the handle."


class ATerminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_without_a_terminal_it_says_so_and_does_not_wait(monkeypatch, capsys):
    monkeypatch.setattr("sys.stdin", io.StringIO(""))
    announce(NOTICE)
    said = capsys.readouterr()
    assert (said.out, said.err) == ("", f"{NOTICE}\n")


def test_at_a_terminal_enter_has_to_be_pressed(monkeypatch, capsys):
    keys = ATerminal("\nnot read")
    monkeypatch.setattr("sys.stdin", keys)
    announce(NOTICE)
    assert capsys.readouterr().err == f"{NOTICE}\nPress Enter to begin. "
    assert keys.read() == "not read"


def test_a_terminal_that_is_closed_is_no_yes(monkeypatch):
    monkeypatch.setattr("sys.stdin", ATerminal(""))
    with pytest.raises(KeyboardInterrupt):
        announce(NOTICE)


def test_a_late_bar_draws_nothing_before_there_is_progress(monkeypatch):
    reader, writer = pty.openpty()
    os.set_blocking(reader, False)
    with os.fdopen(writer, "w") as screen:
        monkeypatch.setattr("sys.stderr", screen)
        with late_bar("Sweeps (s)", total=10.0) as show:
            with pytest.raises(BlockingIOError):
                os.read(reader, 1)
            show(2.0)
            show(4.0)
        drawn = b""
        while b"Sweeps (s)" not in drawn:  # a terminal hands over what has arrived so far
            assert select.select([reader], [], [], 5.0)[0], drawn
            drawn += os.read(reader, 4096)
    os.close(reader)


def test_every_shipped_recording_is_named_in_the_help(capsys):
    from protocols.definition.recording_protocol import RecordingProtocol
    from study.cli.main import main
    from study.store.formats.protocol_files import list_shipped_protocols, read_protocol

    assert main(["record", "--help"]) == 0
    words = capsys.readouterr().out.replace(",", " ").replace("(", " ").replace(")", " ").split()
    recordings = {
        name for name in list_shipped_protocols() if isinstance(read_protocol(name).protocol, RecordingProtocol)
    }
    assert recordings <= set(words)
