"""What `hapteq record` says and asks before a real device moves."""

import io
import os
import pty
import select

import pytest

from study.cli.motion_notice import announce_motion
from study.cli.progress import show_late_bar
from study.errors import StudyError, WrongUseError
from study.session.views.participant_views import DeviceReport
from study.workflows.checks import examine_setup
from study.workflows.checks.examine_setup import Examination

NOTICE = "No person may hold the handle."


class ATerminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize(
    ("hands_off", "held", "moves"), [(True, False, True), (False, False, False), (False, True, False)]
)
def test_without_a_terminal_it_moves_only_where_no_hand_is_said_to_be_there(
    monkeypatch, capsys, hands_off, held, moves
):
    monkeypatch.setattr("sys.stdin", io.StringIO(""))
    if moves:
        announce_motion(NOTICE, hands_off, held)
    else:
        with pytest.raises(WrongUseError, match="in a terminal") as refusal:
            announce_motion(NOTICE, hands_off, held)
        assert refusal.value.saved == "Nothing moved."
        assert ("--hands-off" in refusal.value.do_now) is not held
    said = capsys.readouterr()
    assert (said.out, said.err) == ("", f"{NOTICE}\n")


RECORD = ("record", "sweep", "--out", "a.h5")
EQUALIZE = ("equalize", "a.h5", "wanted.csv", "--out", "f.csv", "--repeat", "2")
CONTACT = ("contact", "a.h5", "tap.csv", "--normal", "0", "0", "1", "--out", "out")
MOVING = {
    "study.workflows.recording.record_device.record_device": RECORD,
    "study.workflows.equalizer.repeat_trajectory.repeat_trajectory": EQUALIZE,
    "study.workflows.equalizer.play_contact.play_contact": CONTACT,
    "study.workflows.diagnosis.write_twin.write_twin": ("twin", "--out", "m.toml"),
    "study.workflows.checks.examine_setup.accept_examined_device": ("doctor", "--timing", "0", "--accept", "Ada"),
    "study.workflows.checks.daily_check.check_today": ("doctor", "--timing", "0", "--daily"),
}


@pytest.mark.parametrize("moving", MOVING)
def test_from_a_script_no_command_moves_a_real_device_without_the_word_that_no_hand_is_there(
    monkeypatch, tmp_path, moving
):
    from study.cli.main import main

    moved = []

    def move(*given, before_moving=None, **others):
        asks = before_moving or getattr(given[-1], "announce", given[-1])
        asks(NOTICE)
        moved.append(moving)
        raise StudyError("Moved", "It moved.", "Stop.")

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.stdin", io.StringIO(""))
    monkeypatch.setattr(moving, move)
    examined = Examination((), DeviceReport("omega3", False, ()), None)
    monkeypatch.setattr(examine_setup, "examine_setup", lambda *_, on_progress: examined)
    command = [*MOVING[moving], "--device", "omega3"]
    assert (main(command), moved) == (2, [])
    assert (main([*command, "--hands-off"]), moved) == (1, [moving])


def test_a_real_device_stays_still_from_a_script(stub, monkeypatch, tmp_path, capsys):
    from study.cli.main import main

    monkeypatch.setattr("sys.stdin", io.StringIO(""))
    assert main(["record", "sweep", "--device", "omega3", "--out", str(tmp_path / "a.h5")]) == 2
    assert "Nothing moved." in capsys.readouterr().err
    assert not (tmp_path / "a.h5").exists()
    assert (stub.safe, stub.get("peak_n")) == (True, 0)


def test_no_simulated_participant_moves_a_real_device_from_a_script_without_that_word(
    stub, monkeypatch, tmp_path, capsys
):
    from study.cli.main import main

    monkeypatch.setattr("sys.stdin", io.StringIO(""))
    data = ["--device", "omega3", "--data", str(tmp_path / "data")]
    for observer in ([], ["--observer", "ideal"]):
        assert main(["study", *observer, *data]) == 2
        assert "A simulated participant ('ideal') takes this session" in capsys.readouterr().err
    assert not (tmp_path / "data").exists()
    assert (stub.safe, stub.get("peak_n")) == (True, 0)


def test_a_recording_into_a_hand_is_not_one_with_hands_off(tmp_path):
    from study.cli.main import main

    assert main(["record", "sweep_hand", "--hands-off", "--out", str(tmp_path / "a.h5")]) == 2
    assert not (tmp_path / "a.h5").exists()


def test_at_a_terminal_enter_has_to_be_pressed(monkeypatch, capsys):
    keys = ATerminal("\nnot read")
    monkeypatch.setattr("sys.stdin", keys)
    announce_motion(NOTICE, hands_off=True)
    assert capsys.readouterr().err == f"{NOTICE}\nPress Enter to begin. "
    assert keys.read() == "not read"


def test_a_terminal_that_is_closed_is_no_yes(monkeypatch):
    monkeypatch.setattr("sys.stdin", ATerminal(""))
    with pytest.raises(KeyboardInterrupt):
        announce_motion(NOTICE, hands_off=False)


def test_a_late_bar_draws_nothing_before_there_is_progress(monkeypatch):
    reader, writer = pty.openpty()
    os.set_blocking(reader, False)
    with os.fdopen(writer, "w") as screen:
        monkeypatch.setattr("sys.stderr", screen)
        with show_late_bar("Sweeps (s)", total=10.0) as show:
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
