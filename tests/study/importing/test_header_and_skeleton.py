import time

import numpy as np
import pytest

from study.importing.arrays.read_arrays import Arrays, read_arrays
from study.importing.build_recording import build_recording
from study.importing.header_map import describe_header_choices, find_header_problems, make_header_map
from study.importing.map_format.import_map import CsvMap
from study.importing.map_format.map_errors import MapNeededError
from study.importing.map_format.map_toml import parse_map
from study.importing.map_format.signal_words import parse_signal_name, propose_roles, split_bracketed_unit
from study.importing.map_skeleton import make_map_skeleton
from study.store.disk.file_errors import UnusableFileError
from study.workflows.recording.import_recording import read_foreign

NO_TIME = "no column is the time (as in 'time [s]'), and no number is the sample rate (as in 'rate_Hz')"


def arrays(tmp_path, header):
    path = tmp_path / "a.csv"
    rows = np.column_stack([np.arange(20) / 100, *[np.ones(20)] * (header.count(","))])
    path.write_text(header + "\n" + "\n".join(",".join(f"{x:g}" for x in row) for row in rows) + "\n")
    return read_arrays(path, CsvMap())


@pytest.mark.parametrize(
    ("header", "expected"),
    [("fx [N]", ("fx", "N")), ("time (s)", ("time", "s")), ("a_x[m/s^2]", ("a_x", "m/s^2")), ("fx", ("fx", "")),
     ("[N]", ("[N]", ""))],
)  # fmt: skip
def test_a_header_is_a_name_and_a_unit(header, expected):
    assert split_bracketed_unit(header) == expected


@pytest.mark.parametrize(
    ("header", "roles"),
    [
        ("time [s],fx [N],ax [m/s^2]", ["command", "response"]),
        ("t (ms),fx (N),x (mm),ax (g)", ["command", "position", "response"]),
        ("time_s [s],torque [N m],angle [deg]", ["command", "response"]),
        ("time_s,force_N,displacement_mm", ["command", "response"]),
        ("t [ms],motor current [A],shaft speed [rpm],shaft angle [turn]", ["command", "response", "position"]),
        ("time_s,MotorTorque_Nm,omega_rad_s,theta_rad", ["command", "response", "position"]),
        ("time [s],force,position", ["command", "response"]),
        ("time [s],fx [lbf],temp [degC],ax [g]", ["command", "condition", "response"]),
        ("time [s],force [lbf],displacement [in],pressure [psi]", ["command", "response", "condition"]),
        ("time [s],force [N],position [mm],setting", ["command", "response", "condition"]),
        ("time [s],current [A],encoder [counts],supply [V]", ["command", "response", "condition"]),
        ("time [s],torque [Nm],motor angle [rad],load angle [rad]", ["command", "response", "response"]),
        ("time [s],force [N],accel [m/s²]", ["command", "response"]),
        ("time [s],command [%],angle [deg]", ["command", "response"]),
        ("time [s],cmd,position,supply [V]", ["command", "response", "condition"]),
    ],
)
def test_a_header_with_units_needs_no_map(tmp_path, header, roles):
    found = make_header_map(arrays(tmp_path, header))
    assert found is not None
    assert [channel.role for channel in found.channel] == roles


def test_arrays_of_one_length_whose_names_say_units_need_no_map(tmp_path):
    time = np.arange(20) / 100
    np.savez(tmp_path / "a.npz", t_s=time, force_N=time, position_mm=time)
    found = make_header_map(read_arrays(tmp_path / "a.npz", CsvMap()))
    assert found is not None
    assert [(each.value, each.role, each.unit) for each in found.channel] == [
        ("force_N", "command", "N"),
        ("position_mm", "response", "mm"),
    ]


@pytest.mark.parametrize(
    ("header", "names"),
    [
        ("t_s,load_lbf,displacement_in,accel_ft/s^2", ["load", "displacement", "accel"]),
        ("time_s,MotorTorque_Nm,omega_rad_s,theta_rad", ["MotorTorque", "omega", "theta"]),
        ("time [s],fx [N],force_x_N,pos_x_mm [mm]", ["fx", "force_x", "pos_x"]),
        ("t_s,force_N,position_mm,position_in", ["force", "position_mm", "position_in"]),
    ],
)
def test_a_channel_does_not_keep_a_unit_in_its_name_that_it_is_no_longer_in(tmp_path, header, names):
    found = make_header_map(arrays(tmp_path, header))
    assert found is not None
    assert [channel.name for channel in found.channel] == names


def test_arrays_of_several_lengths_are_not_guessed_at(tmp_path):
    np.savez(tmp_path / "a.npz", t_s=np.arange(20.0), force_N=np.ones(20), position_mm=np.ones(10))
    assert make_header_map(read_arrays(tmp_path / "a.npz", CsvMap())) is None


def test_a_reference_is_no_response(tmp_path):
    held = arrays(tmp_path, "t_s,u_V,y_m,y_ref_m")
    roles = dict(zip(held.by_name, propose_roles([parse_signal_name(name) for name in held.by_name]), strict=True))
    assert (roles["u_V"], roles["y_m"], roles["y_ref_m"]) == ("command", "response", "helper")


@pytest.mark.parametrize(
    "header",
    ["time [s],fx,ax [m/s^2]", "fx [N],ax [m/s^2]", "time [s],u [V],y [V]", "time [s],fx [N],speed [K],ax [g]",
     "time [s],fx [N],fy [N]", "time [s],phase_A,speed [rpm]", "time [s],force [V],ax [g]", "time,force [N],ax [g]",
     "time [furlong],fx [N],ax [g]"],
)  # fmt: skip
def test_a_header_that_leaves_something_open_is_not_guessed_at(tmp_path, header):
    assert make_header_map(arrays(tmp_path, header)) is None


@pytest.mark.parametrize(
    ("header", "said"),
    [
        ("time [s],position [furlong],force [N]", ["'position [furlong]': 'furlong' is not a unit known here"]),
        ("time,current,angle", ["'time' does not say in which unit the time is (as in 'time [s]')"]),
        ("displacement_mm,force_N", [NO_TIME]),
        ("time [s],current [A],voltage [V],speed [rpm]",
         ["nothing says whether 'current [A]' is the command", "nothing says whether 'voltage [V]' is the command"]),
        ("time [s],force [N],knob,ax [g]", ["nothing says what 'knob' is"]),
        ("time [s],fx [N],fy [N]",
         ["nothing says what the response is (no column is a position, angle, speed or acceleration)"]),
        ("time [s],fx [N],fx [lbf],ax [g]", ["several columns are called 'fx'"]),
    ],
)  # fmt: skip
def test_what_is_unclear_is_said_of_the_column_alone(tmp_path, header, said):
    assert list(find_header_problems(arrays(tmp_path, header))) == said


def test_an_unknown_unit_stays_in_the_map_as_a_comment_and_other_columns_keep_what_they_say(tmp_path):
    text = make_map_skeleton(arrays(tmp_path, "time [s],position [furlong],torque [Nm],battery [V],phase_A"))
    assert "unit = \"\"                   # 'furlong' is not a unit known here" in text
    roles = [line.split('"')[1] for line in text.splitlines() if line.startswith("role")]
    units = [line.split('"')[1] for line in text.splitlines() if line.startswith("unit")]
    assert (roles, units) == (["response", "command", "condition", "helper"], ["", "Nm", "V", "A"])


def test_a_skeleton_names_every_array_and_is_refused_until_it_is_complete(tmp_path):
    held = Arrays(
        tmp_path / "a.npz",
        {"drive_t_ms": np.arange(99.0), "speed": np.ones(99), "daq_time": np.arange(120.0), "y": np.ones((3, 120)),
         "force [N]": np.ones(120), "gain": np.array(3.0), "note": np.array("x"), "cube": np.ones((3, 3, 3)),
         "runs": np.ones((120, 3, 2))},
    )  # fmt: skip
    text = make_map_skeleton(held)
    for words in (
        'time = "drive_t_ms"',
        'time_unit = "ms"',
        'value = "y[2]"',
        "# gain: one number, a constant",
        'unit = "N"',
        "# note holds no numbers",
        'clock = "daq_time"',
        "# cube: 3 x 3 x 3 samples; a channel is one line",
        "# runs: 120 x 3 x 2 samples; a channel is one line: runs[:, 0, 0]",
    ):
        assert words in text
    with pytest.raises(UnusableFileError) as refused:
        parse_map(text, tmp_path / "m.toml")
    assert any(problem.startswith('device is ""') for problem in refused.value.problems)
    assert any(problem.startswith('channel[2].role is ""') for problem in refused.value.problems)


def test_a_completed_skeleton_is_a_map(tmp_path):
    held = Arrays(tmp_path / "a.npz", {"fs": np.array(100.0), "u": np.ones(50), "y": np.ones(50)})
    first, _, second = make_map_skeleton(held).partition('name = "y"')
    first = first.replace('device = ""', 'device = "rig"').replace('role = "" ', 'role = "command" ', 1)
    complete = first.replace('role = "" ', 'role = "response" ', 1) + 'name = "y"' + second
    found = parse_map(complete, tmp_path / "m.toml")
    assert found.clock[0].rate == "fs" and found.segment == ()  # without segments, periods that repeat are found
    assert [(channel.role, channel.name) for channel in found.channel] == [("command", "u"), ("response", "y")]


@pytest.mark.parametrize(
    ("name", "unit", "quantity", "sure"),
    [
        ("u_mm", "mm", "position", False), ("displacement_mm", "mm", "position", True),
        ("omega_rad_s", "rad/s", "velocity", True), ("a_mps2", "m/s^2", "acceleration", True),
        ("torque_Nm", "N m", "torque", True), ("phase_A", "A", "current", False), ("speed [N]", "N", "force", False),
        ("force", "", "force", True), ("voltage_raw", "", "voltage", True), ("knob", "", "", True),
        ("alpha_deg", "deg", "angle", False), ("load [furlong]", "", "force", False),
        ("Roll [deg/s]", "deg/s", "velocity", True), ("Spannung [MPa]", "MPa", "pressure", True),
    ],
)  # fmt: skip
def test_quantity_and_unit_are_read_out_of_a_name(name, unit, quantity, sure):
    found = parse_signal_name(name)
    assert (found.unit, found.quantity, found.is_certain) == (unit, quantity, sure)


def runs(*names):
    return {name: np.random.default_rng(1).normal(size=40) for name in names}


@pytest.mark.parametrize(
    ("names", "prefixes"),
    [
        (("A01__u_mm", "A01__y_N", "A02__u_mm", "A02__y_N"), ("A01__", "A02__")),
        (("pos_0p06_1__u_Nm", "pos_0p06_1__omega_rad_s", "neg_2__u_Nm", "neg_2__omega_rad_s"),
         ("pos_0p06_1__", "neg_2__")),
        (("run1/force", "run1/speed", "run2/force", "run2/speed"), ("run1/", "run2/")),
        (("run1_force", "run1_speed", "run2_force", "run2_speed"), ("run1_", "run2_")),
        (("daq_force", "daq_t", "drive_speed", "drive_t"), ()),
        (("motor_force", "motor_speed", "load_force", "load_speed"), ()),
        (("force", "speed"), ()),
    ],
)  # fmt: skip
def test_several_runs_in_a_file_are_proposed_as_parts(tmp_path, names, prefixes):
    text = make_map_skeleton(Arrays(tmp_path / "a.npz", runs(*names) | {"fs": np.array(100.0)}))
    assert [line for line in text.splitlines() if line.startswith("prefix")] == [f'prefix = "{p}"' for p in prefixes]
    assert text.count("[[channel]]") == (len(names) // len(prefixes) if prefixes else len(names))


def test_a_proposal_for_several_runs_needs_a_device_and_no_more(tmp_path):
    arrays = runs("A01__u_mm", "A01__y_N", "A02__u_mm", "A02__y_N")
    np.savez(tmp_path / "a.npz", fs_Hz=100.0, **arrays)
    text = make_map_skeleton(read_arrays(tmp_path / "a.npz", CsvMap())).replace('device = ""', 'device = "rig"')
    found = build_recording(parse_map(text, tmp_path / "m.toml"), [tmp_path / "a.npz"]).recording
    assert (found.command.unit, found.response.unit, found.sample_rate_hz, len(found)) == ("m", "N", 100.0, 80)
    np.testing.assert_allclose(found.command.samples[40:, 0], arrays["A02__u_mm"] / 1000)
    assert [part["prefix"] for part in found.meta["parts"]] == ["A01__", "A02__"]


@pytest.mark.parametrize(
    ("names", "roles"),
    [
        (("u_V", "theta_ref_deg", "theta_deg"), ["command", "helper", "response"]),
        (("u_Nm", "theta_rad", "omega_rad_s", "current_A"), ["command", "position", "response", "helper"]),
        (("u_mm", "y_N"), ["command", "response"]),
        (("x_mm", "y_mm", "force_N"), ["response", "response", "command"]),
        (("position_rad", "current_A", "voltage_raw"), ["response", "", ""]),
        (("torque_cmd", "torque_Nm", "speed"), ["command", "command", "response"]),
        (("position_demand_mm", "position_mm", "current_A"), ["command", "response", "command"]),
        (("knob", "force_N", "a_g"), ["", "command", "response"]),
        (("knob", "dial"), ["", ""]),
    ],
)
def test_roles_are_proposed_where_names_say_them(tmp_path, names, roles):
    text = make_map_skeleton(Arrays(tmp_path / "a.npz", runs(*names)))
    found = [line.split('"')[1] for line in text.splitlines() if line.startswith("role = ")]
    assert found == roles


def test_a_number_in_hertz_is_the_rate_of_an_archive_and_its_runs_are_parts(tmp_path):
    count = 400
    runs = {
        f"run{run}__{name}": np.full(count, float(run)) for run in (1, 2) for name in ("force_N", "displacement_mm")
    }
    np.savez(tmp_path / "a.npz", fs_Hz=250.0, **runs)
    read = read_arrays(tmp_path / "a.npz", CsvMap())
    built = build_recording(make_header_map(read), [tmp_path / "a.npz"], lambda share: None)
    recording = built.recording
    assert recording.sample_rate_hz == 250.0
    assert len(recording) == 2 * count
    assert recording.command.samples[[0, -1], 0].tolist() == [1.0, 2.0]
    assert recording.response.samples[-1, 0] == pytest.approx(2e-3)


@pytest.mark.parametrize(
    ("beside", "problem"),
    [
        ({"gain": 250.0}, "no number is the sample rate (as in 'rate_Hz')"),
        ({"fs": 250.0}, "'fs' does not say in which unit it is (as in 'fs_Hz')"),
        ({"Ts": 0.004}, "'Ts' does not say in which unit it is (as in 'Ts_s')"),
        ({"fs_Hz": 250.0, "rate_Hz": 500.0}, "which of 'fs_Hz' and 'rate_Hz' is the sample rate is ambiguous"),
    ],
    ids=["none", "without a unit", "a step without a unit", "two"],
)
def test_a_rate_without_a_unit_is_not_guessed_and_of_two_none_is_chosen(tmp_path, beside, problem):
    np.savez(tmp_path / "a.npz", force_N=np.ones(400), displacement_mm=np.ones(400), **beside)
    assert any(problem in said for said in find_header_problems(read_arrays(tmp_path / "a.npz", CsvMap())))


@pytest.mark.parametrize("none", ["N/A", "n/a", "-"])
def test_no_unit_may_be_said_in_brackets(none):
    assert (parse_signal_name(f"force [{none}]").unit, parse_signal_name(f"force [{none}]").doubt) == ("", "")


@pytest.mark.parametrize("header", ["p [bar g]", "pressure [bar g]", "x [N V]"])
def test_a_unit_of_nothing_that_is_known_is_doubted(header):
    assert "what is measured in" in parse_signal_name(header).doubt


@pytest.mark.parametrize(("unit", "said"), [("A rms", True), ("A (peak)", True), ("Arms", True), ("A", False)])
def test_rms_and_peak_values_are_kept_with_a_note(tmp_path, unit, said):
    for header in (f"time [s],current [{unit}],speed [rpm]", f"time,current,speed\ns,{unit},rpm"):
        held = arrays(tmp_path, header.partition("\n")[0])
        text = held.path.read_text().partition("\n")[2]
        held.path.write_text(f"{header}\n{text}")
        held = read_arrays(held.path, CsvMap())
        wanted = make_header_map(held)
        assert wanted is not None
        assert wanted.channel[0].unit == "A"
        assert any("Rms or peak values" in note for note in describe_header_choices(held, wanted)) == said


def test_names_of_many_columns_take_no_time_by_the_square(tmp_path):
    held = arrays(tmp_path, "time [s]," + ",".join(f"sensor_front_left_upper_raw_value_{k}" for k in range(300)))
    begin = time.process_time()
    assert len(find_header_problems(held)) == 300
    assert time.process_time() - begin < 2
    with pytest.raises(MapNeededError) as refused:
        read_foreign((held.path,), None)
    assert refused.value.happened.endswith("; and more.")
