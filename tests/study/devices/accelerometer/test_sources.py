"""Data-acquisition devices behind the same port. Their packages are fakes here: what is tested is what hapteq makes of
their answers, not the packages, drivers or devices."""

import contextlib
import sys
import time
import tomllib
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

from study.devices.accelerometer.calibration import GRAVITY_MPS2, UP_DIRECTIONS, Calibration
from study.devices.accelerometer.sensor import Accelerometer
from study.devices.accelerometer.six_positions import calibrate_in_six_positions
from study.devices.accelerometer.sources import LOST_SCAN_V, open_source
from study.errors import DeviceError

RATE_HZ = 3999.0
"""What the drivers make of 4000."""
VOLTS = Calibration(np.array([1.65, 1.6, 1.7]), 0.0306 * np.eye(3), np.zeros(3), 0.0)
UP_FIRST = GRAVITY_MPS2 * UP_DIRECTIONS[4]


class Scanner:
    """Both makers' devices: scans by wall time."""

    def __init__(self) -> None:
        self.acceleration, self.calls, self.lost = UP_FIRST, [], set()
        self.started_s, self.read_up_to = time.monotonic(), 0

    def scans(self) -> np.ndarray:
        due = int((time.monotonic() - self.started_s) * RATE_HZ)
        numbers = np.arange(self.read_up_to, due)
        self.read_up_to = due
        volts = np.tile(VOLTS.bias + VOLTS.sensitivity @ self.acceleration, (len(numbers), 1))
        volts[np.isin(numbers, list(self.lost))] = LOST_SCAN_V
        return volts


@pytest.fixture
def ni(monkeypatch):
    scanner = Scanner()
    task = SimpleNamespace(
        ai_channels=SimpleNamespace(add_ai_voltage_chan=lambda name: scanner.calls.append(name)),
        timing=SimpleNamespace(
            cfg_samp_clk_timing=lambda rate, sample_mode: scanner.calls.append((rate, sample_mode)),
            samp_clk_rate=RATE_HZ,
        ),
        start=lambda: scanner.calls.append("start"),
        read=lambda number_of_samples_per_channel: scanner.scans().T.tolist(),
        close=lambda: scanner.calls.append("close"),
    )
    scanner.task = task
    constants = SimpleNamespace(READ_ALL_AVAILABLE=-1, AcquisitionType=SimpleNamespace(CONTINUOUS="continuous"))
    monkeypatch.setitem(sys.modules, "nidaqmx", SimpleNamespace(Task=lambda: task))
    monkeypatch.setitem(sys.modules, "nidaqmx.constants", constants)
    return scanner


@pytest.fixture
def labjack(monkeypatch):
    scanner = Scanner()

    def read(handle):
        time.sleep(0.01)
        return scanner.scans().ravel().tolist(), 0, 0

    ljm = SimpleNamespace(
        openS=lambda *names: scanner.calls.append(names) or 7,
        namesToAddresses=lambda count, names: ([0, 2, 4], [3, 3, 3]),
        eStreamStart=lambda handle, scans, count, addresses, rate: (
            scanner.calls.append((handle, scans, count, addresses, rate)) or RATE_HZ
        ),
        eStreamRead=read,
        eStreamStop=lambda handle: scanner.calls.append("stop"),
        close=lambda handle: scanner.calls.append("close"),
    )
    scanner.ljm = ljm
    monkeypatch.setitem(sys.modules, "labjack", ModuleType("labjack"))
    monkeypatch.setitem(sys.modules, "labjack.ljm", ljm)
    return scanner


@pytest.mark.parametrize("kind", ["ni", "labjack"])
def test_samples_come_numbered_timed_and_in_units(request, kind):
    scanner = request.getfixturevalue(kind)
    with contextlib.closing(Accelerometer(open_source(f"{kind}:Dev1", 1), VOLTS, (0.7, 2.6))) as sensor:
        time.sleep(1.3)
        sensor.zero(0.2)
        scanner.acceleration = UP_FIRST + [1.0, -2.0, 0.5]
        time.sleep(0.5)
        now_s = time.monotonic()
        tick_s = now_s - 0.2 + np.arange(150) / 1000
        sensed = sensor.sensed(now_s - 0.2, tick_s, 1000.0)
        assert np.allclose(sensor.read_latest()[0], [1.0, -2.0, 0.5], atol=1e-6)
    np.testing.assert_allclose(sensed.acceleration_mps2, np.tile([1.0, -2.0, 0.5], (150, 1)), atol=1e-6)
    assert sensed.health.lost == 0 and abs(sensed.health.drift_ppm) < 500
    assert scanner.calls[-1] == "close"


def test_each_is_asked_for_three_channels_at_4_khz(ni, labjack):
    open_source("ni:Dev1", 1).close()
    assert ni.calls == ["Dev1/ai0:2", (4000.0, "continuous"), "start", "close"]
    open_source("labjack:470010117", 1).close()
    assert labjack.calls == [("ANY", "ANY", "470010117"), (7, 40, 3, [0, 2, 4], 4000.0), "stop", "close"]


def test_scans_that_a_labjack_lost_are_counted_and_left_out(labjack):
    labjack.lost = {3, 4, 30}
    source, sequence = open_source("labjack:ANY", 1), []
    while len(sequence) < 50:
        samples, _ = source.read()
        sequence += samples.sequence.tolist()
        assert (samples.raw != LOST_SCAN_V).all()
    assert sequence == [k for k in range(sequence[-1] + 1) if k not in labjack.lost]
    assert (source.counts.lost, source.counts.packets) == (3, len(sequence))


def test_six_positions_in_volts(ni):
    turns = iter(UP_DIRECTIONS)

    def lay_down(position, heard):
        ni.acceleration = GRAVITY_MPS2 * next(turns)

    table = tomllib.loads(calibrate_in_six_positions("ni:Dev1", 1, lay_down, rest_s=0.2))["accelerometer"]
    np.testing.assert_allclose(table["sensitivity"], VOLTS.sensitivity, atol=1e-6)
    np.testing.assert_allclose(table["bias"], VOLTS.bias, atol=1e-6)
    assert table["raw_range"] == pytest.approx([1.6 - 3 * 9.80665 * 0.0306, 1.7 + 3 * 9.80665 * 0.0306], abs=1e-6)


@pytest.mark.parametrize(("port", "extra"), [("ni:Dev1", "ni"), ("labjack:ANY", "labjack")])
def test_a_package_that_is_not_installed_is_named_with_what_installs_it(monkeypatch, port, extra):
    for name in ("nidaqmx", "labjack", "labjack.ljm"):
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(DeviceError, match=rf"is not installed.*pip install '\.\[{extra}\]'"):
        open_source(port, 1)


def test_a_driver_or_a_device_that_is_missing_is_told_and_nothing_stays_open(ni, labjack):
    def missing(*_, **__):
        raise RuntimeError("no such device")

    ni.task.start = missing
    with pytest.raises(DeviceError, match=r"ni:Dev1: RuntimeError: no such device.*NI-DAQmx"):
        open_source("ni:Dev1", 1)
    assert ni.calls[-1] == "close"
    labjack.ljm.eStreamStart = missing
    with pytest.raises(DeviceError, match=r"labjack:ANY: .*LJM library"):
        open_source("labjack:ANY", 1)
    assert labjack.calls[-1] == "close"
