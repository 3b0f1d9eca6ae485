"""Pieces that clip are played again with less; what is kept is clean, and says so."""

from dataclasses import replace
from importlib.resources import files

import numpy as np
import pytest

from protocols.definition.apparatus import SafetySettings, SpringSettings
from protocols.definition.recording_protocol import RecordingProtocol
from protocols.definition.recording_segments import MultisineSegment, SweepSegment
from protocols.document.loading import load_protocol
from study.devices.clock import RealClock, VirtualClock
from study.devices.safe import SafeDevice
from study.errors import DeviceError, StudyError, UserInterruptError
from study.store.formats.recording_file import read_recording
from study.workflows.diagnosis.write_twin import TwinPlan, write_twin
from study.workflows.recording.play_pieces import MAX_TAKES
from study.workflows.recording.record_device import RecordingPlan, record_device, record_on_device
from tests.slow_instances import slow

SWEEP = SweepSegment("sweep", 5.0, 30.0, 1.0, "x", duration_s=0.5)
MULTISINE = MultisineSegment("multisine", 5.0, 30.0, 1.0, "all", 1.0, realisations=3, role="test")
PROTOCOL = RecordingProtocol(
    name="short",
    kind="recording",
    title="Short",
    segments=(SWEEP, replace(SWEEP, along="y")),
    safety=SafetySettings(stimulus_cap_n=1.5, total_cap_n=3.0),
    rest_s=0.2,
)


@pytest.fixture
def device_that_clips_at(rigs):
    """A mass of 0.3 kg whose accelerometer ends at so many m/s² along x."""
    opened = []

    def build(limit_mps2: float, simulated: bool = True, **limits) -> SafeDevice:
        rig = replace(rigs.compiled_rig(), info=replace(rigs.INFO, simulated=simulated))
        rig.parameters[2] = limit_mps2
        settings = replace(rigs.SETTINGS, hand_on_handle=False, limits=replace(rigs.LIMITS, **limits))
        opened.append(SafeDevice(rig, settings, VirtualClock()))
        return opened[-1]

    yield build
    for device in opened:
        device.close()


def plan(out, protocol=PROTOCOL) -> RecordingPlan:
    return RecordingPlan(protocol, device="simulated", place_m=(0.0, 0.0, 0.0), seed=2, out=out)


def amplitudes(recording) -> list[float]:
    return [segment.amplitude for segment in recording.segments]


def test_a_piece_that_clips_is_played_again_with_less_and_the_others_are_not(tmp_path, device_that_clips_at):
    done = record_on_device(device_that_clips_at(5.0), plan(tmp_path / "r.h5"), lambda _: None)
    recording = read_recording(tmp_path / "r.h5")
    assert amplitudes(recording) == pytest.approx([0.7, 1.0])
    assert np.abs(recording.response.samples[:, 0]).max() < 5.0
    x, y = recording.meta["segments"]
    assert (x["requested_amplitude_n"], x["played_amplitude_n"], x["tries"]) == (1.0, pytest.approx(0.7), 2)
    assert (y["requested_amplitude_n"], y["played_amplitude_n"], y["tries"]) == (1.0, 1.0, 1)
    assert x["sensor_clipped"] == 0
    played = recording.excitation.samples[recording.segments[0].start : recording.segments[0].stop]
    assert np.abs(played).max() == pytest.approx(0.7, rel=1e-2)
    (warning,) = done.warnings
    assert warning.startswith("Played at 0.7 N instead of 1 N (sweep along x): the accelerometer clipped in ")


def test_only_the_clean_take_is_kept(tmp_path, device_that_clips_at):
    record_on_device(device_that_clips_at(2.5), plan(tmp_path / "r.h5"), lambda _: None)
    recording = read_recording(tmp_path / "r.h5")
    assert recording.meta["segments"][0]["tries"] == 4
    assert len(recording) == sum(round(1.4 * 1000) for _ in PROTOCOL.segments)


def test_what_had_to_be_lowered_is_so_at_once_when_it_comes_round_again(tmp_path, device_that_clips_at):
    again = replace(PROTOCOL, repeats=2)
    done = record_on_device(device_that_clips_at(5.0), plan(tmp_path / "r.h5", again), lambda _: None)
    recording = read_recording(tmp_path / "r.h5")
    assert amplitudes(recording) == pytest.approx([0.7, 1.0, 0.7, 1.0])
    assert [about["tries"] for about in recording.meta["segments"]] == [2, 1, 1, 1]
    assert done.warnings[1] == "Played at 0.7 N instead of 1 N (sweep along x): as before."


def test_nothing_goes_below_the_least_amplitude_and_what_still_clips_is_reported(tmp_path, device_that_clips_at):
    bounded = replace(PROTOCOL, segments=(SWEEP,), least_amplitude_n=0.6)
    done = record_on_device(device_that_clips_at(0.1), plan(tmp_path / "r.h5", bounded), lambda _: None)
    (about,) = read_recording(tmp_path / "r.h5").meta["segments"]
    assert (about["played_amplitude_n"], about["tries"]) == (pytest.approx(0.6), 3)
    assert about["sensor_clipped"] > 0
    assert done.warnings[0].startswith("Played at 0.6 N instead of 1 N (sweep along x): ")
    assert done.warnings[1].endswith(" samples at 0.6 N (sweep along x).")


def test_a_broken_sensor_does_not_keep_the_device_moving_for_ever(tmp_path, device_that_clips_at):
    patient = replace(PROTOCOL, segments=(SWEEP,), least_amplitude_n=1e-6)
    record_on_device(device_that_clips_at(-1.0), plan(tmp_path / "r.h5", patient), lambda _: None)
    (about,) = read_recording(tmp_path / "r.h5").meta["segments"]
    assert about["tries"] == MAX_TAKES


def test_a_protocol_may_keep_the_amplitude_when_samples_clip(tmp_path, device_that_clips_at):
    stubborn = replace(PROTOCOL, lower_on_clip=False)
    done = record_on_device(device_that_clips_at(5.0), plan(tmp_path / "r.h5", stubborn), lambda _: None)
    recording = read_recording(tmp_path / "r.h5")
    assert amplitudes(recording) == [1.0, 1.0]
    assert recording.meta["segments"][0]["sensor_clipped"] > 0
    assert done.warnings[0].startswith("The accelerometer clipped in ")


def test_the_cap_of_the_total_force_lowers_too(tmp_path, device_that_clips_at):
    device = device_that_clips_at(1e3, total_cap_n=1.0, stimulus_cap_n=1.0)
    done = record_on_device(device, plan(tmp_path / "r.h5", replace(PROTOCOL, segments=(SWEEP,))), lambda _: None)
    (about,) = read_recording(tmp_path / "r.h5").meta["segments"]
    assert about["played_amplitude_n"] < 1.0
    assert about["total_clipped"] == 0
    assert "the force was at its cap for " in done.warnings[0]


def test_progress_steps_back_where_a_piece_is_played_again_and_ends_at_the_whole(tmp_path, device_that_clips_at):
    seconds: list[float] = []
    record_on_device(device_that_clips_at(5.0), plan(tmp_path / "r.h5"), seconds.append)
    assert seconds != sorted(seconds)
    assert seconds[-1] == pytest.approx(plan(tmp_path / "x.h5").total_s)


def test_interrupted_in_a_second_try_the_pieces_before_are_kept(tmp_path, device_that_clips_at):
    seen: list[float] = []

    def press(seconds: float) -> None:
        if seen and seconds < seen[-1]:
            raise KeyboardInterrupt
        seen.append(seconds)

    y_first = replace(PROTOCOL, segments=(replace(SWEEP, along="y"), SWEEP))
    with pytest.raises(UserInterruptError) as left:
        record_on_device(device_that_clips_at(5.0), plan(tmp_path / "r.h5", y_first), press)
    assert left.value.happened.startswith("1 of 2 pieces")
    recording = read_recording(tmp_path / "r.h5")
    assert amplitudes(recording) == [1.0]
    assert [about["along"] for about in recording.meta["segments"]] == ["y"]


def test_a_device_that_lets_go_says_along_which_axis(tmp_path, device_that_clips_at):
    device = device_that_clips_at(1e3)
    with pytest.raises(DeviceError, match="While recording along all axes: the emergency stop was pressed"):
        record_on_device(
            device,
            plan(tmp_path / "r.h5", replace(PROTOCOL, segments=(MULTISINE,))),
            lambda s: device.stop() if s else 0,
        )
    assert not (tmp_path / "r.h5").exists()


def test_before_a_real_device_moves_it_is_said_who_may_hold_the_handle(tmp_path, device_that_clips_at):
    said: list[str] = []

    def still(notice: str) -> None:
        said.append(notice)
        assert progress == []

    progress: list[float] = []
    record_on_device(device_that_clips_at(1e3, simulated=False), plan(tmp_path / "r.h5"), progress.append, still)
    assert len(said) == 1
    assert said[0].startswith("No person may hold the handle: 'mass'")
    assert progress != []


def test_a_real_device_does_not_move_after_the_answer_no(tmp_path, device_that_clips_at):
    def no(notice: str) -> None:
        raise KeyboardInterrupt

    device = device_that_clips_at(1e3, simulated=False)
    with pytest.raises(UserInterruptError, match="0 of 2 pieces were recorded"):
        record_on_device(device, plan(tmp_path / "r.h5"), lambda _: None, no)
    assert device.look().position_m == (0.0, 0.0, 0.0)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "move",
    [
        lambda folder: record_device(plan(folder / "r.h5"), lambda _: None),
        lambda folder: write_twin(TwinPlan(folder / "m.toml"), lambda _: None),
    ],
    ids=["record_device", "write_twin"],
)
def test_from_python_a_real_device_does_not_move_unannounced(tmp_path, device_that_clips_at, monkeypatch, move):
    device = device_that_clips_at(1e3, simulated=False)
    monkeypatch.setattr("study.workflows.recording.record_device.open_device", lambda *given: device)
    monkeypatch.setattr(device, "play", lambda *given: pytest.fail("it moved"))
    with pytest.raises(StudyError, match="without a warning"):
        move(tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_a_simulated_device_needs_no_warning(tmp_path, device_that_clips_at):
    said: list[str] = []
    record_on_device(device_that_clips_at(1e3), plan(tmp_path / "r.h5"), lambda _: None, said.append)
    assert said == []


def test_on_the_simulated_device_excitation_and_total_force_are_both_kept_and_exactly_periodic(tmp_path):
    periodic = replace(PROTOCOL, segments=(replace(SWEEP, periods=3, role="fit"), MULTISINE))
    record_device(plan(tmp_path / "r.h5", periodic), lambda _: None)
    recording = read_recording(tmp_path / "r.h5")
    assert [(s.kind, s.role, s.period) for s in recording.segments] == [
        ("sweep", "fit", 500), *[("multisine", "test", 1000)] * 3,
    ]  # fmt: skip
    for segment in recording.segments:
        played = recording.excitation.samples[segment.start : segment.stop].reshape(-1, segment.period, 3)
        assert np.array_equal(played[1], played[-1])
    feedback, about = recording.command.samples - recording.excitation.samples, recording.meta["feedback"]
    assert feedback == pytest.approx(-about["stiffness_n_per_m"] * recording.position.samples, abs=1e-9)
    assert [s["unit_vector"] for s in recording.meta["segments"]] == [[1.0, 0.0, 0.0], None, None, None]
    assert [s["realisation"] for s in recording.meta["segments"]] == [1, 1, 2, 3]
    assert recording.meta["segments"][1]["band_hz"] == [5.0, 30.0]


def test_the_written_stiffness_is_the_springs_also_without_one(tmp_path):
    free = replace(PROTOCOL, segments=(SWEEP,), spring=SpringSettings(natural_frequency_hz=0.0))
    record_device(plan(tmp_path / "r.h5", free), lambda _: None)
    recording = read_recording(tmp_path / "r.h5")
    assert recording.meta["feedback"]["stiffness_n_per_m"] == 0.0
    assert np.array_equal(recording.command.samples, recording.excitation.samples)


SHIPPED = (
    "sweep",
    *slow("multisine", "sweep_band", "sweep_study", "sweep_hand"),
)


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_recordings_are_played_as_they_are_asked_for_without_waiting(tmp_path, monkeypatch, name):
    """No cap, no sensor and no slew limit is in their way, and a simulated device waits for no answer."""
    monkeypatch.setattr(RealClock, "sleep", lambda clock, seconds: pytest.fail(f"waited for {seconds} s"))
    shipped = load_protocol(files("protocols").joinpath(f"{name}.toml").read_text("utf-8"), name)
    asked = plan(tmp_path / "r.h5", shipped)
    written = record_device(asked, lambda _: None)
    assert written.warnings == ()
    recording = read_recording(tmp_path / "r.h5")
    assert recording.meta["hand"] == shipped.hand
    assert len(recording) == pytest.approx(asked.total_s * recording.sample_rate_hz)
