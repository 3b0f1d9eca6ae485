"""A device that answers with a recording: exactly where it can, nearly elsewhere, and never because of a force."""

import contextlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from equalizer.signals.joining import join_recordings
from equalizer.signals.recording import Recording
from equalizer.signals.signal import Signal
from study.cli.main import main
from study.devices.clock import VirtualClock
from study.devices.device import DeviceInfo, Fault
from study.devices.governor import cells
from study.devices.governor.governor import pack_settings
from study.devices.opening import open_device
from study.errors import DeviceError
from study.store.formats.recording_file import read_recording, write_recording


def played_on(name: str, rigs, commands: list[np.ndarray]) -> list[Recording]:
    with contextlib.closing(open_device(name, rigs.SETTINGS, VirtualClock(), seed=4)) as device:
        return [device.play(rigs.force(samples)).recording for samples in commands]


@pytest.fixture(scope="module")
def commands(rigs):
    return [np.tile(rigs.sine(1.0, periods).loop.samples, (periods, 1)) for periods in (5, 25, 10)]


@pytest.fixture(scope="module")
def originals(rigs, commands):
    return played_on("simulated", rigs, commands)


@pytest.fixture(scope="module")
def file(originals, tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("recorded") / "lab.h5"
    write_recording(path, join_recordings(originals, {}))
    return path


def test_commands_that_were_recorded_are_answered_as_they_were_in_any_order(rigs, commands, originals, file):
    replayed = played_on(f"replay:{file}", rigs, [*commands, commands[1], commands[0]])
    for found, right in zip(replayed, [*originals, originals[1], originals[0]], strict=True):
        np.testing.assert_array_equal(found.response.samples, right.response.samples)
        np.testing.assert_array_equal(found.position.samples, right.position.samples)
        np.testing.assert_allclose(found.excitation.samples, right.excitation.samples, atol=1e-12)


def test_accelerations_of_a_turned_sensor_are_replayed_in_the_axes_of_the_device(rigs, commands, originals, tmp_path):
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    (original, *_), frame = originals, {"sensor": {"frame_to_device": turn.tolist()}}
    right = original.response.samples.copy()
    right[7, 1] = np.nan  # on one axis of the sensor alone
    measured = replace(original.response, samples=right[:, [1, 0, 2]] * [1.0, -1.0, 1.0])
    write_recording(tmp_path / "turned.h5", replace(original, response=measured, meta=frame))
    (found,) = played_on(f"replay:{tmp_path / 'turned.h5'}", rigs, commands[:1])
    np.testing.assert_array_equal(found.response.samples, right)
    mirrored = {"sensor": {"frame_to_device": np.diag([1.0, 1.0, -1.0]).tolist()}}
    write_recording(tmp_path / "mirrored.h5", replace(original, meta=mirrored))
    with pytest.raises(DeviceError, match=r"mirrored\.h5: the sensor's frame is a reflection"):
        played_on(f"replay:{tmp_path / 'mirrored.h5'}", rigs, commands[:1])


def test_a_part_of_what_was_recorded_is_found_in_its_middle(rigs, commands, originals, file):
    (found,) = played_on(f"replay:{file}", rigs, [0.5 * (commands[1] + np.roll(commands[1], 1, axis=0))])
    assert len(found) == 1000
    # 25 Hz: nothing else is near.
    heard = np.abs(np.fft.rfft(found.response.samples[:, 2] * np.hanning(1000)))
    assert np.argmax(heard) == 25
    first = (found.response.samples[0] == join_recordings(originals, {}).response.samples).all(axis=1)
    assert 999 <= np.flatnonzero(first)[0] < 2000


def test_no_force_changes_what_is_replayed(rigs, commands, file):
    (usual,) = played_on(f"replay:{file}", rigs, [commands[0]])
    settings = replace(rigs.SETTINGS, spring_frequency_hz=0.0, spring_damping_n_s_per_m=0.0)
    with contextlib.closing(open_device(f"replay:{file}", settings, VirtualClock(), seed=1)) as device:
        without_spring = device.play(rigs.force(commands[0])).recording
    assert np.abs(usual.command.samples - without_spring.command.samples).max() > 0.01
    np.testing.assert_array_equal(usual.response.samples, without_spring.response.samples)


def test_a_held_stimulus_continues_without_a_seam(rigs, file):
    clock = VirtualClock()
    with contextlib.closing(open_device(f"replay:{file}", rigs.SETTINGS, clock, seed=1)) as device:
        device.hold(rigs.sine(1.0, 25))
        looks = []
        for _ in range(3000):
            clock.sleep(0.001)
            device.keep_alive()
            looks.append(device.look())
        assert device.fault() is Fault.NONE
        device.release()
    steps = np.diff([look.position_m for look in looks], axis=0)
    assert np.abs(steps).max() < 2 * np.percentile(np.abs(steps).max(axis=1), 99)
    accelerations = np.array([look.acceleration_mps2 for look in looks])
    assert np.std(accelerations[:, 2]) > 1.0


def test_a_stretch_of_the_whole_recording_plays_without_a_crossfade(rigs, commands, tmp_path):
    (only,) = played_on("simulated", rigs, [commands[0][:200]])
    write_recording(tmp_path / "short.h5", only)
    clock = VirtualClock()
    with contextlib.closing(open_device(f"replay:{tmp_path / 'short.h5'}", rigs.SETTINGS, clock, seed=1)) as device:
        device.hold(rigs.sine(1.0, 5))
        for _ in range(20):
            clock.sleep(0.1)
            device.keep_alive()
        assert device.release().health.ticks > 1500
        # Longer than there is: the end stays.
        longer = device.play(rigs.force(commands[0]))
        assert longer.health.fault is Fault.NONE
        assert np.ptp(longer.recording.position.samples[200:], axis=0).max() == 0.0


def test_a_recorded_protocol_recorded_again_is_the_same_recording(tmp_path, capsys):
    words = ["record", "ellipsoid", "--seed", "3", "--out"]
    assert main([*words, str(tmp_path / "lab.h5")]) == 0
    assert main([*words, str(tmp_path / "again.h5"), "--device", f"replay:{tmp_path / 'lab.h5'}"]) == 0
    first, again = (read_recording(tmp_path / f"{name}.h5") for name in ("lab", "again"))
    np.testing.assert_array_equal(again.response.samples, first.response.samples)
    np.testing.assert_array_equal(again.position.samples, first.position.samples)
    assert again.device == "replay of simulated omega.3"


@pytest.mark.slow
def test_a_simulated_participant_takes_a_study_on_a_replayed_device(rigs, file, small_text, tmp_path, capsys):
    protocol = tmp_path / "short.toml"
    protocol.write_text(small_text)
    data = ["--data", str(tmp_path / "data"), "--observer", "ideal", "--seed", "5"]
    assert main(["study", "--protocol", str(protocol), "--device", f"replay:{file}", *data]) == 0, (
        capsys.readouterr().err
    )
    rows = (tmp_path / "data" / "ideal1_001" / "trials.csv").read_text().splitlines()
    assert len(rows) > 8
    assert not any("void" in row for row in rows[1:])


def test_a_recorded_handle_that_rests_under_a_force_is_no_frozen_encoder(rigs, originals, commands, tmp_path):
    still = originals[1]
    at_rest = replace(still.position, samples=np.tile(still.position.samples[:1], (len(still), 1)))
    write_recording(tmp_path / "still.h5", replace(still, position=at_rest))
    with contextlib.closing(open_device(f"replay:{tmp_path / 'still.h5'}", rigs.SETTINGS, VirtualClock(), 1)) as device:
        played = device.play(rigs.force(commands[1]))
        assert played.health.fault is Fault.NONE
        assert np.ptp(played.recording.position.samples, axis=0).max() == 0.0


def test_a_position_that_is_missing_in_the_recording_does_not_end_the_stimulus(rigs, originals, commands, tmp_path):
    """As of missed ticks: it is interpolated from its neighbours."""
    gappy = originals[1].position.samples.copy()
    gappy[[0, 400, 401, 402]] = np.nan
    position = replace(originals[1].position, samples=gappy)
    write_recording(tmp_path / "gappy.h5", replace(originals[1], position=position))
    with contextlib.closing(open_device(f"replay:{tmp_path / 'gappy.h5'}", rigs.SETTINGS, VirtualClock(), 1)) as device:
        played = device.play(rigs.force(commands[1]))
    assert played.health.fault is Fault.NONE
    replayed = played.recording.position.samples
    np.testing.assert_allclose(replayed[399:404], np.linspace(gappy[399], gappy[403], 5), rtol=0, atol=1e-12)
    np.testing.assert_array_equal(replayed[403:], gappy[403:])


def test_only_a_simulated_device_may_stand_still_under_a_force(rigs):
    info = DeviceInfo("replayed", True, 1000.0, 12.0, 0.2, moved_by_force=False)
    packed = [
        pack_settings(each, rigs.SETTINGS)[cells.STALE_TICKS]
        for each in (info, replace(info, simulated=False), replace(info, moved_by_force=True))
    ]
    assert packed[0] > 1e12
    assert packed[1] == packed[2] < 1e4


@pytest.mark.real_time
def test_doctor_checks_a_replayed_device(file, capsys):
    assert main(["doctor", "--device", f"replay:{file}"]) in (0, 1)
    said = capsys.readouterr()
    assert "replay of simulated omega.3" in said.out + said.err


def without(name: str, recording: Recording) -> Recording:
    if name == "position":
        return replace(recording, position=None)
    if name == "position in numbers":
        return replace(recording, position=replace(recording.position, samples=0 * recording.position.samples + np.nan))
    if name == "response":
        return replace(
            recording, response=Signal(recording.response.samples, 1000.0, "velocity", "m/s", ("vx", "vy", "vz"))
        )
    volts = Signal(recording.command.samples, 1000.0, "voltage", "V", ("ux", "uy", "uz"))
    return replace(recording, command=volts, excitation=None)


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("position", "no position"),
        ("position in numbers", "no position"),
        ("response", "no acceleration"),
        ("command", "no force"),
    ],
)
def test_a_recording_that_cannot_be_replayed_is_refused_with_the_reason(rigs, originals, tmp_path, name, says):
    write_recording(tmp_path / "lab.h5", without(name, originals[0]))
    with pytest.raises(DeviceError, match=f"lab.h5 has {says}"):
        open_device(f"replay:{tmp_path / 'lab.h5'}", rigs.SETTINGS, VirtualClock(), seed=1)


@pytest.mark.parametrize("content", [None, b"not a recording"])
def test_a_file_that_is_no_recording_is_an_error_of_the_device(rigs, tmp_path, content):
    path = tmp_path / "lab.h5"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(DeviceError, match="This cannot be replayed"):
        open_device(f"replay:{path}", rigs.SETTINGS, VirtualClock(), seed=1)


def test_axes_in_another_order_are_told_by_their_names(rigs, originals, commands, tmp_path):
    def turned(signal: Signal) -> Signal:
        return replace(
            signal, samples=signal.samples[:, [2, 0, 1]], channels=tuple(signal.channels[i] for i in (2, 0, 1))
        )

    original = originals[0]
    names = ("command", "excitation", "response", "position")
    write_recording(
        tmp_path / "turned.h5", replace(original, **{name: turned(getattr(original, name)) for name in names})
    )
    (found,) = played_on(f"replay:{tmp_path / 'turned.h5'}", rigs, [commands[0]])
    np.testing.assert_array_equal(found.response.samples, original.response.samples)
    np.testing.assert_array_equal(found.position.samples, original.position.samples)
