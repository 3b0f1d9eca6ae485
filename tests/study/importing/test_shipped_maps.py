"""Our maps on the recordings that they are for."""

import numpy as np
import pytest

from equalizer.signals.recording import Hold
from study.importing.build_recording import build_recording
from study.importing.map_library import find_maps_for_folder
from study.store.formats.recording_file import read_recording, write_recording
from study.workflows.files.validate import validate_file

ACTUATOR = "vibration_actuator"
EXPECTED = {
    # (folder, name): rate, samples, command unit, response channels and unit, segments, hold
    ("bldc_motor", "bldc_motor_holding"): (1.0, 31666, "A", 1, "rad", 3, "linear"),
    ("bldc_motor", "bldc_motor_running"): (1000.0, 15000, "A", 1, "rad/s", 2, "linear"),
    ("emps", "emps"): (1000.0, 2 * 24841, "N", 1, "m", 2, "zero-order"),
    ("f16_gvt", "f16_gvt"): (400.0, 7 * 24576, "N", 3, "m/s^2", 7, "band-limited"),
    ("f16_gvt", "f16_gvt_sweeps"): (400.0, 2 * 108477, "N", 3, "m/s^2", 2, "band-limited"),
    ("haptic_paddle", "haptic_paddle_torque"): (999.493, 14845, "N m", 1, "rad", 2, "linear"),
    ("haptic_paddle", "haptic_paddle_steps"): (2857.14, 89992, "N m", 1, "rad", 9, "zero-order"),
    ("haptic_paddle", "haptic_paddle_sensors"): (952.381, 11522, "rad", 1, "V", 2, "band-limited"),
    ("rack_drive", "rack_drive"): (2000.0, 1078, "m/s", 1, "N", 1, "linear"),
    ("rotary_beam", "rotary_beam"): (500.0, 2500, "V", 2, "rad", 2, "zero-order"),
    ("shaker_damper", "shaker_damper_a"): (100.0, 15010, "m", 1, "N", 10, "linear"),
    ("shaker_damper", "shaker_damper_b"): (100.0, 12008, "m", 1, "N", 8, "linear"),
    ("shaker_damper", "shaker_damper_c"): (100.0, 13509, "m", 1, "N", 9, "linear"),
    ("silverbox", "silverbox"): (610.3515625, 90421, "V", 1, "V", 10, "band-limited"),
    ("silverbox", "silverbox_growing_noise"): (610.3515625, 40575, "V", 1, "V", 2, "band-limited"),
    ("silverbox", "silverbox_schroeder"): (610.3515625, 131072, "V", 1, "V", 4, "band-limited"),
    ("two_motor_drive", "two_motor_drive"): (1000.0, 240000, "N m", 1, "rad/s", 12, "zero-order"),
    (ACTUATOR, f"{ACTUATOR}_clip_condition1_clip"): (8820.0, 15876, "V", 1, "m/s^2", 1, "band-limited"),
    (ACTUATOR, f"{ACTUATOR}_clip_condition2_clip"): (8820.0, 15876, "V", 1, "m/s^2", 1, "band-limited"),
    (ACTUATOR, f"{ACTUATOR}_noise_condition1_noise"): (8820.0, 17640, "V", 1, "m/s^2", 2, "band-limited"),
    (ACTUATOR, f"{ACTUATOR}_noise_condition2_noise"): (8820.0, 17640, "V", 1, "m/s^2", 2, "band-limited"),
    (ACTUATOR, f"{ACTUATOR}_repeats"): (5000.0, 500000, "V", 1, "m/s^2", 2, "zero-order"),
}  # fmt: skip


_built: dict = {}


@pytest.fixture
def imported(shared):
    def build(folder, name):
        if name not in _built:
            found = {entry.name: entry for entry in find_maps_for_folder(shared / "recordings" / folder)}
            _built[name] = build_recording(found[name].source.map, found[name].files)
        return _built[name]

    return build


@pytest.mark.parametrize("folder", sorted({folder for folder, _ in EXPECTED}))
def test_all_maps_of_a_folder_are_found(shared, folder):
    found = [entry.name for entry in find_maps_for_folder(shared / "recordings" / folder)]
    assert sorted(found) == sorted(name for place, name in EXPECTED if place == folder)


@pytest.mark.parametrize(("folder", "name"), EXPECTED)
def test_a_recording_comes_out_sound(imported, tmp_path, folder, name):
    rate_hz, samples, command_unit, responses, response_unit, segments, hold = EXPECTED[folder, name]
    found = imported(folder, name).recording
    assert found.sample_rate_hz == pytest.approx(rate_hz, abs=0.01)
    assert found.command.samples.shape == (samples, 1)
    assert found.response.samples.shape == (samples, responses)
    assert (found.command.unit, found.response.unit, found.hold) == (command_unit, response_unit, Hold(hold))
    assert len(found.segments) == segments
    assert np.isfinite(found.command.samples).all()
    assert np.isfinite(found.response.samples).all()
    write_recording(tmp_path / "r.h5", found)
    checked = validate_file(tmp_path / "r.h5")
    assert checked.problems == ()
    assert checked.kind.startswith("recording, ")
    assert read_recording(tmp_path / "r.h5").segments == found.segments


def test_the_feedback_of_the_positioning_system_closes(imported, shared):
    """Force from the reference less what the controller takes off for the motion."""
    found = imported("emps", "emps").recording
    gains = found.meta["parts"][0]
    position = found.response.samples[:24841, 0]
    taken_off = gains["kv_v_s_per_m"] * (gains["kp_per_s"] * position + np.gradient(position, 1e-3))
    rest = found.excitation.samples[:24841, 0] - gains["gain_n_per_v"] * taken_off - found.command.samples[:24841, 0]
    assert np.std(rest) < 0.07 * np.std(found.command.samples)


def test_levels_of_the_aircraft_rise_and_alternate_between_fit_and_test(imported):
    segments = imported("f16_gvt", "f16_gvt").recording.segments
    assert [segment.role for segment in segments] == ["fit", "test", "fit", "test", "fit", "test", "fit"]
    assert all(segment.period == 8192 for segment in segments)
    peaks = [segment.amplitude for segment in segments]
    assert peaks == sorted(peaks)


def test_periods_are_periods(imported):
    """In each periodic segment the command is the same one period later."""
    names = ("f16_gvt", "silverbox", "silverbox_schroeder", "haptic_paddle_torque", "vibration_actuator_repeats")
    for folder, name in (key for key in EXPECTED if key[1] in names):
        found = imported(folder, name).recording
        for segment in (segment for segment in found.segments if segment.period):
            command = found.command.samples[segment.start : segment.stop, 0]
            change = command[segment.period :] - command[: -segment.period]
            start = segment.period if name == "f16_gvt" else 0  # whose first period holds the transient
            assert np.std(change[start:]) < 0.02 * np.std(command), (name, segment)


def test_the_last_multisine_of_the_oscillator_is_the_test(imported):
    segments = imported("silverbox", "silverbox").recording.segments
    ten = [segment.role for segment in segments if segment.kind == "multisine"]
    assert ten == ["fit"] * 3 + [""] * 6 + ["test"]


def test_the_paddles_torque_is_what_its_firmware_commands(imported, shared):
    found = imported("haptic_paddle", "haptic_paddle_torque").recording
    logged = np.load(shared / "recordings" / "haptic_paddle" / "torque_sine.npz")
    begun_s = found.meta["parts"][0]["clock_start_s"]
    torque = np.interp(logged["t_s"], begun_s + found.command.compute_times_s(), found.command.samples[:, 0])
    delayed = 15 * 0.0011 * np.sin(2 * 3.14 * (logged["t_s"] - 0.000175))
    np.testing.assert_allclose(torque[:-2], delayed[:-2], atol=1e-6)
    np.testing.assert_allclose(delayed, 15 * logged["u_motor_Nm"], atol=2e-5)
    angle = np.interp(begun_s + found.response.compute_times_s(), logged["t_s"], logged["y_deg"])
    np.testing.assert_allclose(np.degrees(found.response.samples[:, 0]), angle, atol=0.3)


def test_every_step_of_the_paddle_goes_ten_degrees_with_a_torque_that_starts_it(imported):
    found = imported("haptic_paddle", "haptic_paddle_steps").recording
    for part in found.meta["parts"]:
        at_lever = slice(part["start"], part["stop"])
        angle, torque = np.degrees(found.response.samples[at_lever, 0]), found.command.samples[at_lever, 0]
        begun = int(np.argmax(found.excitation.samples[at_lever, 0] > 0))
        assert 0.99 < begun / found.sample_rate_hz < 1.01
        assert np.median(angle[-1000:]) - np.median(angle[:1000]) == pytest.approx(10, abs=2)
        assert torque[begun] == pytest.approx(part["kp_n_m_per_deg"] * 10, rel=0.35)


def test_what_the_import_of_the_rack_did_is_reported(imported, shared):
    found = imported("rack_drive", "rack_drive")
    assert found.notes == (
        "Clock 'drive' is moved by 0 ms to that of 'daq', as the map states.",
        "rack: resampled from 1500 Hz to 2000 Hz, band-limited, flat to 660 Hz.",
        "Computed: position 'rack' = integral(rack), in m.",
    )
    logged = np.load(shared / "recordings" / "rack_drive" / "rack_drive.npz")
    stroke_m = -np.sum(logged["drive_speed_rpm"]) * 20 / 1000 / 60 / 1500
    assert found.recording.position.samples[-1, 0] == pytest.approx(stroke_m, rel=1e-3)


def test_the_motors_current_is_what_its_speed_loop_makes_of_the_reference(imported):
    found = imported("bldc_motor", "bldc_motor_running").recording
    current, decided = found.command.samples[2:, 0], found.excitation.samples[2:, 0]
    rest = current - (decided - 0.087 * found.response.samples[:-2, 0])
    assert np.std(rest) < 0.1 * np.std(current)


def test_the_beams_voltage_follows_the_angle_that_is_still_missing(imported):
    found = imported("rotary_beam", "rotary_beam").recording
    missing = found.excitation.samples[:, 0] - 9.5 * found.response.samples[:, 0]
    slow = np.abs(missing) < 0.5
    assert np.abs(found.command.samples[slow, 0]).mean() < 0.5
    assert np.corrcoef(missing, found.command.samples[:, 0])[0, 1] > 0.5


def test_odd_tests_of_the_shaken_device_are_fitted_and_even_ones_test(imported):
    for setting in "abc":
        segments = imported("shaker_damper", f"shaker_damper_{setting}").recording.segments
        assert [segment.role for segment in segments] == [
            ("fit", "test")[number % 2] for number in range(len(segments))
        ]


def test_repeats_of_the_two_motors_are_fitted_kept_and_tested(imported):
    segments = imported("two_motor_drive", "two_motor_drive").recording.segments
    assert [segment.role for segment in segments] == ["fit", "", "test"] * 4
