"""`hapteq doctor` as an experimenter before a study day and as a script uses it."""

import contextlib
import json
from importlib.metadata import packages_distributions
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from study.cli import doctor
from study.cli.main import main
from study.devices.accelerometer import sensor_findings, six_positions
from study.devices.accelerometer.calibration import GRAVITY_MPS2, UP_DIRECTIONS
from study.devices.device import Fault, Health
from study.devices.force_dimension import findings
from study.devices.force_dimension.usb import UsbDevice
from study.errors import ExitCode
from study.session.stimulus.timing_verdict import judge_lateness, judge_load, summarize_lateness
from study.session.views.participant_views import DeviceFinding, DeviceReport
from study.workflows.checks import daily_check, examine_setup
from study.workflows.checks.check_timing import Timing
from study.workflows.checks.examine_setup import Examination
from tests.slow_instances import slow_rows
from tests.study.devices.accelerometer.pty_board import Board, table_of

HEALTH = Health(Fault.NONE, 2000, 0, 0, 0, 0, 0, 0.0)

needs_installation = pytest.mark.skipif(
    "hapteq" not in packages_distributions().get("hapteq_launcher", ()),
    reason="hapteq is not installed in this environment",
)


@pytest.fixture
def run(capsys):
    def call(*arguments: object) -> tuple[int, str]:
        capsys.readouterr()
        code = main(["doctor", *map(str, arguments)])
        return int(code), capsys.readouterr().out

    return call


@needs_installation
def test_nothing_is_wrong_with_the_simulated_device_however_busy_this_computer_is(run, tmp_path):
    code, out = run("--timing", 0.3, "--data", tmp_path)
    assert code == 0, out
    lines = out.splitlines()
    assert [line for line in lines if not line.startswith(" ")][:3] == ["Installation", "Device", "Timing"]
    warnings = sum(line.startswith("  WARN ") for line in lines)
    assert lines[-1].startswith(f"{warnings} of " if warnings else "All ")
    assert "WRONG" not in out


@needs_installation
def test_a_program_gets_one_document(run, tmp_path):
    code, out = run("--timing", 0.3, "--data", tmp_path, "--json")
    document = json.loads(out)
    told = (*document["installation"], *document["device"]["findings"], *document["timing"]["findings"])
    assert code == 0
    assert document["fine"] is all(finding["fine"] for finding in told)
    assert document["device"]["simulated"]
    assert {"name", "value", "fine", "advice", "warning"} == set(document["installation"][0])
    timing = document["timing"]
    assert (timing["seconds"], timing["health"]["missed_ticks"], timing["health"]["fault"]) == (0.3, 0, "none")
    assert timing["health"]["peak_command_n"] == 0
    assert 0 <= timing["lateness"]["median_ms"] <= timing["lateness"]["p99_ms"] <= timing["lateness"]["longest_ms"]


def test_timing_can_be_left_out(run, tmp_path):
    _, out = run("--timing", 0, "--data", tmp_path)
    assert "Timing" not in out
    _, out = run("--timing", 0, "--data", tmp_path, "--json")
    assert json.loads(out)["timing"] is None


def test_a_device_that_cannot_be_opened_is_a_finding_and_exit_code_3(run, tmp_path):
    code, out = run("--device", "omega", "--data", tmp_path)
    assert code == 3
    assert "WRONG  Device             There is no device called 'omega'." in out
    assert "Use --device simulated" in out
    assert out.splitlines()[-1].endswith("checks are not fine.")
    assert "Installation" in out


def verdicts(out: str) -> dict[str, str]:
    lines = out[out.index("\nDevice\n") :].splitlines()[2:]
    return {line[9:26].strip(): line[2:7].strip() for line in lines if line.startswith("  ") and line[2] != " "}


def test_a_missing_library_is_a_finding_that_says_what_to_install(run, tmp_path, monkeypatch):
    monkeypatch.setenv("FDSDK", str(tmp_path))
    monkeypatch.setenv("HOME", str(tmp_path))
    code, out = run("--device", "omega3", "--data", tmp_path)
    assert (code, verdicts(out)["Driver"]) == (3, "WRONG")
    assert "Install the Force Dimension SDK" in out


@pytest.mark.parametrize(
    ("plugged_in", "usb"),
    [((), "WARN"), (None, None)]
    + slow_rows(((UsbDevice("omega.3", True),), "fine"), ((UsbDevice("omega.3", False),), "WRONG")),
)
def test_what_needs_no_library_is_told_without_one(run, stub, tmp_path, monkeypatch, plugged_in, usb):
    monkeypatch.setenv("FDSDK", str(tmp_path / "nowhere"))
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setattr(findings, "find_usb_devices", lambda: plugged_in)
    _, out = run("--device", "omega3", "--data", tmp_path)
    found = verdicts(out)
    assert (found["Driver"], found["Accelerometer"], found.get("USB")) == ("WRONG", "WARN", usb)
    assert "Priority" in found
    (tmp_path / "none.toml").write_text("[accelerometer")
    assert {"Driver", "Priority"} <= set(verdicts(run("--device", "omega3", "--data", tmp_path)[1]))


SENSOR_TABLE = """[accelerometer]
port = "/nowhere/ttyACM7"
bias = [32100.0, 32350.0, 32800.0]
sensitivity = [[607.0, 3.0, -5.0], [-4.0, 611.0, 2.0], [6.0, 1.0, 598.0]]
raw_range = [13800, 51200]
"""


@pytest.mark.slow
def test_a_sensor_that_is_not_plugged_in_is_a_line_of_its_own_and_all_else_is_checked(run, stub, tmp_path):
    (tmp_path / "none.toml").write_text(SENSOR_TABLE)
    code, out = run("--device", "omega3", "--data", tmp_path, "--timing", 0.2)
    found = verdicts(out)
    assert (code, found["Accelerometer"], found["Device"]) == (3, "WRONG", "fine")
    assert "The accelerometer cannot be opened. /nowhere/ttyACM7" in out and out.count("cannot be opened") == 1
    assert {"Answers", "Handle", "Rate", "Late ticks"} <= set(found)
    assert "\nTiming\n" in out
    assert stub.safe


@pytest.mark.real_time
def test_a_sensor_that_is_there_is_told_with_rate_losses_clock_and_noise(run, stub, tmp_path, monkeypatch):
    monkeypatch.setattr(sensor_findings, "MEASUREMENT_S", 1.0)
    with contextlib.closing(Board(2000.0)) as board:
        (tmp_path / "none.toml").write_text(table_of(board))
        _, out = run("--device", "omega3", "--data", tmp_path, "--timing", 0)
    found = verdicts(out)
    assert {"Sensor rate", "Sensor losses", "Sensor clock"} <= set(found)
    assert (found["Sensor losses"], found["Sensor noise"]) == ("fine", "WARN")  # the same value again and again
    assert "samples per second" in out and "ppm" in out


@pytest.mark.real_time
def test_six_positions_by_enter_are_kept_in_the_lab_s_file(capsys, monkeypatch, tmp_path):
    monkeypatch.setenv("HAPTEQ_DEVICE_FILE", str(tmp_path / "lab.toml"))
    monkeypatch.setattr(six_positions, "REST_S", 0.3)
    with contextlib.closing(Board(2000.0)) as board:
        laid = iter(UP_DIRECTIONS)

        def readline() -> str:
            board.acceleration = GRAVITY_MPS2 * next(laid)
            return "\n"

        monkeypatch.setattr("sys.stdin", SimpleNamespace(readline=readline))
        assert main(["doctor", "--calibrate-sensor", board.path, "--keep"]) == 0
    out, err = capsys.readouterr()
    assert err.count("let go of it, and press Enter") == 6 and err.count("  read ") == 5
    assert f"Written into {tmp_path / 'lab.toml'}" in err
    assert (tmp_path / "lab.toml").read_text() == out


def test_a_real_device_is_found_with_library_firmware_calibration_and_watchdog(run, stub, tmp_path):
    code, out = run("--device", "omega3", "--data", tmp_path, "--timing", 0)
    found = verdicts(out)
    of_driver = ("Library", "Connection", "Power", "Calibration", "Watchdog", "Masses", "Gravity")
    assert {found[name] for name in (*of_driver, "Answers", "Handle", "Rate", "Largest force")} == {"fine"}
    assert "omega.3, serial 4242, firmware 2.41, SDK 3.17.5.0" in out
    assert "set to 30.0 ms; without forces the device let go within" in out
    assert "0.28 kg, assumed" in out
    assert code != 3
    assert found["Accelerometer"] == "WARN"  # none is configured: it is said how to add it
    assert f"Accelerometer      none is configured in {tmp_path / 'none.toml'}" in out
    assert "--calibrate-sensor PORT" in out and "docs/hardware.md, The accelerometer" in out
    assert "## The accelerometer" in (Path(__file__).parents[3] / "docs" / "hardware.md").read_text("utf-8")
    assert stub.safe
    assert (stub.get("opened"), stub.get("peak_n")) == (0, 0)


@pytest.mark.parametrize(
    ("switch", "value", "wrong", "cure"),
    [
        ("powered", 0, "Power", "Switch its power supply on."),
        ("calibrated", 0, "Calibration", "hapteq doctor --device omega3 --calibrate"),
        ("watchdog_works", 0, "Driver", "Do not let a person hold the handle."),
        ("in_use", 1, "Driver", "Close the other program."),
        *slow_rows(("read_fails", 2, "Answers", "Check its power and its cable")),
    ],
)
def test_what_is_missing_is_reported_with_its_cure(run, stub, tmp_path, switch, value, wrong, cure):
    stub.set(switch, value)
    code, out = run("--device", "omega3", "--data", tmp_path, "--timing", 0)
    assert (code, verdicts(out)[wrong]) == (3, "WRONG")
    assert cure in out
    stub.set("in_use", 0)
    assert (stub.safe, stub.get("opened"), stub.get("peak_n")) == (True, 0, 0)


@pytest.mark.parametrize(
    ("weight_n", "way", "cure"),
    [(2.5, "sinks", "larger"), *slow_rows((0.5, "rises", "smaller"))],
)
def test_a_handle_of_another_weight_is_a_warning(run, stub, tmp_path, weight_n, way, cure):
    """The compensation carries 0.148 kg, so 1.45 N."""
    stub.set("weight", weight_n)
    _, out = run("--device", "omega3", "--data", tmp_path, "--timing", 0)
    assert verdicts(out)["Gravity"] == "WARN"
    assert f"the handle {way} at" in out and f"device.toml {cure}" in out.replace("none.toml", "device.toml")


@pytest.mark.slow
def test_a_device_can_be_calibrated_from_here(run, stub, tmp_path):
    stub.set("calibrated", 0)
    stub.set("reset_after_s", 0.05)
    _, out = run("--device", "omega3", "--data", tmp_path, "--timing", 0, "--calibrate")
    assert verdicts(out)["Calibration"] == "fine"
    assert stub.safe


def test_a_handle_that_is_not_brought_there_is_an_error(run, stub, tmp_path, monkeypatch):
    monkeypatch.setattr(doctor, "CALIBRATION_TIMEOUT_S", 0.1)
    stub.set("calibrated", 0)
    stub.set("reset_after_s", 100)
    assert run("--device", "omega3", "--data", tmp_path, "--timing", 0, "--calibrate")[0] == 3
    assert stub.safe


def test_a_simulated_device_has_nothing_to_calibrate(run, tmp_path):
    assert run("--timing", 0, "--data", tmp_path, "--calibrate")[0] == 3


def test_an_installation_that_is_not_fine_is_exit_code_1(run, tmp_path):
    (tmp_path / "data").write_text("a file")
    code, out = run("--timing", 0, "--data", tmp_path / "data", "--json")
    assert code == 1
    document = json.loads(out)
    assert not document["fine"]
    assert "Data folder" in [finding["name"] for finding in document["installation"] if not finding["fine"]]


def test_a_negative_time_is_wrong_use(run):
    assert run("--timing", -1)[0] == 2


def examination(timing: Timing) -> Examination:
    fine = DeviceFinding("hapteq", "0.1.0", fine=True)
    return Examination((fine,), DeviceReport("a device", timing.findings[0].warning, (fine,)), timing)


def measured(late_ms: float, load: float, simulated: bool) -> Timing:
    lateness = summarize_lateness(np.full(2000, late_ms / 1000.0), 1000.0)
    return Timing(2.0, HEALTH, lateness, (judge_lateness(lateness, simulated), judge_load(load)))


@pytest.mark.parametrize(
    ("late_ms", "load", "simulated", "code", "verdicts", "summary"),
    [
        (0.2, 0.1, True, ExitCode.DONE, ("fine", "fine"), "All 4 checks are fine."),
        (0.2, 0.1, False, ExitCode.DONE, ("fine", "fine"), "All 4 checks are fine."),
        (67.0, 0.1, True, ExitCode.DONE, ("WARN", "fine"), "1 of 4 checks are not fine. 1 of them is a warning."),
        (67.0, 2.0, True, ExitCode.DONE, ("WARN", "WARN"), "2 of 4 checks are not fine. 2 of them are warnings."),
        (67.0, 0.1, False, ExitCode.DEVICE, ("WRONG", "fine"), "1 of 4 checks are not fine."),
        (0.2, 2.0, False, ExitCode.DONE, ("fine", "WARN"), "1 of 4 checks are not fine. 1 of them is a warning."),
    ],
)
def test_verdict_figures_summary_and_exit_code_agree(capsys, late_ms, load, simulated, code, verdicts, summary):
    looked = examination(measured(late_ms, load, simulated))
    doctor._print_findings(looked)
    lines = capsys.readouterr().out.splitlines()
    timing = [
        line.split() for line in lines[lines.index("Timing") + 1 : -1] if line.startswith("  ") and line[2] != " "
    ]
    assert tuple(words[0] for words in timing) == verdicts
    assert (looked.exit_code, lines[-1]) == (code, summary)
    assert not any(line.lstrip().startswith("fine") and "too late" in line for line in lines)
    assert doctor._make_document(looked)["fine"] is (summary[:3] == "All")


def test_without_a_sensor_no_daily_check_begins(run, monkeypatch, tmp_path):
    lacks = DeviceFinding("Accelerometer", "none is configured", fine=False, warning=True)
    setup = Examination((), DeviceReport("omega3", False, (lacks,)), None)
    monkeypatch.setattr(examine_setup, "examine_setup", lambda *_, on_progress: setup)
    monkeypatch.setattr(daily_check, "check_today", lambda *_: pytest.fail("it moved"))
    assert run("--device", "omega3", "--data", tmp_path, "--daily", "--hands-off")[0] == 3


@pytest.mark.parametrize(("fine", "code"), [(True, ExitCode.DONE), (False, ExitCode.DEVICE)])
def test_a_daily_check_that_told_nothing_is_no_success(run, monkeypatch, tmp_path, fine, code):
    told = DeviceFinding("Noise", "", fine=fine, warning=not fine)
    checked = daily_check.DailyCheckResult((told,), tmp_path / "a.json")
    monkeypatch.setattr(daily_check, "check_today", lambda *_: checked)
    setup = Examination((), DeviceReport("omega3", False, ()), None)
    monkeypatch.setattr(examine_setup, "examine_setup", lambda *_, on_progress: setup)
    assert run("--device", "omega3", "--data", tmp_path, "--daily", "--hands-off")[0] == code
