"""Recordings on the simulated device."""

import os
import signal
from dataclasses import replace

import numpy as np
import pytest

import study.workflows.recording.record_device as record_device_module
from protocols.definition.apparatus import SafetySettings
from protocols.definition.recording_protocol import RecordingProtocol
from protocols.definition.recording_segments import SineSegment, SweepSegment
from study.devices.device import Fault
from study.devices.safe import SafeDevice
from study.errors import DeviceError, StudyError, UserInterruptError
from study.store.disk.file_errors import AlreadyExistsError, CannotWriteError
from study.store.formats.recording_file import read_recording, write_recording
from study.workflows.recording.record_device import RecordingPlan, record_device

PROTOCOL = RecordingProtocol(
    name="short",
    kind="recording",
    title="Short",
    segments=(
        SineSegment("sine", (15.0, 25.0), 1.0, "direction_1", duration_s=0.8, settle_s=0.5),
        SweepSegment("sweep", 2.0, 200.0, 1.0, "y", duration_s=1.0),
    ),
    safety=SafetySettings(stimulus_cap_n=1.5, total_cap_n=3.0),
    rest_s=0.3,
)


def plan(out, protocol=PROTOCOL) -> RecordingPlan:
    return RecordingPlan(protocol, device="simulated", place_m=(0.0, 0.0, 0.0), seed=2, out=out)


def test_a_recording_holds_what_the_protocol_asked_for(tmp_path):
    progress: list[float] = []
    record_device(plan(tmp_path / "r.h5"), progress.append)
    recording = read_recording(tmp_path / "r.h5")
    assert [s.kind for s in recording.segments] == ["sine", "sine", "sweep"]
    assert [s["frequency_hz"] for s in recording.meta["segments"]] == [15.0, 25.0, None]
    for segment, about in zip(recording.segments, recording.meta["segments"], strict=True):
        played = recording.excitation.samples[segment.start : segment.stop] @ np.array(about["unit_vector"])
        assert np.abs(played).max() == pytest.approx(1.0, rel=0.02)
    assert progress == sorted(progress)
    assert progress[-1] == pytest.approx(plan(tmp_path / "x.h5").total_s)


def test_the_spring_is_in_the_command_and_not_in_the_excitation(tmp_path):
    record_device(plan(tmp_path / "r.h5"), lambda _: None)
    recording = read_recording(tmp_path / "r.h5")
    feedback = recording.command.samples - recording.excitation.samples
    stiffness = -np.sum(feedback * recording.position.samples) / np.sum(recording.position.samples**2)
    about = recording.meta["feedback"]
    expected = about["effective_mass_kg"] * (2 * np.pi * about["natural_frequency_hz"]) ** 2
    assert stiffness == pytest.approx(expected, rel=1e-3)


def test_interrupted_the_whole_pieces_are_written(tmp_path):
    def press(seconds: float) -> None:
        if seconds > 3.5:
            raise KeyboardInterrupt

    with pytest.raises(UserInterruptError) as left:
        record_device(plan(tmp_path / "r.h5"), press)
    assert left.value.happened.startswith("1 of 3 pieces were recorded")
    recording = read_recording(tmp_path / "r.h5")
    assert recording.meta["interrupted"] is True
    assert len(recording.segments) == 1


def test_interrupted_at_once_nothing_is_written(tmp_path):
    def press(seconds: float) -> None:
        raise KeyboardInterrupt

    with pytest.raises(UserInterruptError) as left:
        record_device(plan(tmp_path / "r.h5"), press)
    assert left.value.saved == "Nothing was written."
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_another_program_made_meanwhile_costs_no_recording(tmp_path):
    """Neither that file nor the recording, which was lost."""
    out, free = tmp_path / "r.h5", tmp_path / "r_3.h5"
    (tmp_path / "r_2.h5").write_text("an older one")
    with pytest.raises(AlreadyExistsError) as told:
        record_device(plan(out), lambda _: out.write_text("another"))
    assert told.value.saved == f"The file is as it was; the recording is in {free}."
    assert out.read_text() == "another"
    assert len(read_recording(free).segments) == 3


def test_an_error_of_the_writing_does_not_hide_that_the_force_may_still_be_on(tmp_path, monkeypatch):
    """After an interruption, with a file of that name made meanwhile."""
    out = tmp_path / "r.h5"

    def press(seconds: float) -> None:
        if seconds > 3.5:
            out.write_text("another")
            monkeypatch.setattr(SafeDevice, "fault", lambda self: Fault.FORCE_LEFT)
            raise KeyboardInterrupt

    with pytest.raises(DeviceError, match="The force may still be on") as told:
        record_device(plan(out), press)
    assert told.value.saved.endswith(f"the recording is in {tmp_path / 'r_2.h5'}.")
    assert len(read_recording(tmp_path / "r_2.h5").segments) == 1


def test_a_folder_that_does_not_exist_is_reported_before_anything_moves(tmp_path):
    with pytest.raises(StudyError, match="There is no folder"):
        record_device(plan(tmp_path / "nowhere" / "r.h5"), lambda _: None)


def test_without_space_for_the_file_nothing_is_played(tmp_path, monkeypatch):
    def refuse(*arguments) -> None:
        raise OSError(28, os.strerror(28))

    monkeypatch.setattr(os, "posix_fallocate", refuse)
    played: list[float] = []
    with pytest.raises(CannotWriteError, match="The disk is full") as refused:
        record_device(plan(tmp_path / "r.h5"), played.append)
    assert (refused.value.saved, played) == ("Nothing moved, and nothing was written.", [])
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("segments", [PROTOCOL.segments, PROTOCOL.segments[1:]], ids=["three", "one"])
def test_the_reserved_space_is_enough_for_the_file(tmp_path, monkeypatch, segments):
    reserved: list[int] = []
    monkeypatch.setattr(os, "posix_fallocate", lambda descriptor, start, size: reserved.append(size))
    record_device(plan(tmp_path / "r.h5", replace(PROTOCOL, segments=segments)), lambda _: None)
    assert (tmp_path / "r.h5").stat().st_size <= reserved[0]


@pytest.mark.parametrize("signal_name", ["SIGINT", "SIGTERM"])
def test_an_interruption_while_the_file_is_written_loses_nothing(tmp_path, monkeypatch, signal_name):
    def interrupt(seconds: float) -> None:
        raise KeyboardInterrupt

    def write_interrupted(*arguments) -> None:
        os.kill(os.getpid(), getattr(signal, signal_name))
        write_recording(*arguments)

    before = signal.signal(getattr(signal, signal_name), lambda *_: interrupt(0.0))
    monkeypatch.setattr(record_device_module, "write_recording", write_interrupted)
    try:
        record_device(plan(tmp_path / "r.h5"), lambda _: None)
        handler = signal.getsignal(getattr(signal, signal_name))
    except KeyboardInterrupt:
        pytest.fail("the recording is lost")
    finally:
        signal.signal(getattr(signal, signal_name), before)
    assert handler is not signal.SIG_IGN
    assert len(read_recording(tmp_path / "r.h5").segments) == 3
