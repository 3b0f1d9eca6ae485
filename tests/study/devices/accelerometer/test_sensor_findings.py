"""What doctor says of a board: a good one, and one with each thing wrong."""

import contextlib

import numpy as np
import pytest

from study.devices.accelerometer import sensor_findings
from study.devices.accelerometer.sensor import Accelerometer
from study.devices.accelerometer.serial_reader import open_serial
from tests.study.devices.accelerometer.pty_board import AT_REST, IDEAL, RAW_RANGE, Board

# The board is a thread of this process behind a pseudo-terminal: with all cores full it may send late.
pytestmark = [pytest.mark.real_time, pytest.mark.may_be_late]


def noisy(noise_mps2):
    random = np.random.default_rng(1)
    return lambda host_s: AT_REST + np.asarray(noise_mps2) * random.standard_normal((len(host_s), 3))


def found(
    monkeypatch,
    rate_hz=4000.0,
    drift_ppm=0.0,
    noise_mps2=(0.04, 0.04, 0.08),
    spoil=lambda block: block,
    measurement_s=0.8,
):
    monkeypatch.setattr(sensor_findings, "MEASUREMENT_S", measurement_s)
    with contextlib.closing(Board(rate_hz, drift_ppm)) as board:
        board.signal, board.spoil = noisy(noise_mps2), spoil
        with contextlib.closing(Accelerometer(open_serial(board.path, 2_000_000), IDEAL, RAW_RANGE)) as sensor:
            findings = {finding.name: finding for finding in sensor_findings.check_sensor(sensor)}
    assert not any(finding.wrong for finding in findings.values())
    return findings, {name for name, finding in findings.items() if finding.warning}


def test_a_good_board_is_fine_with_its_figures(monkeypatch):
    """Read for as long as doctor reads: drift is uncertain by a delay of a packet over the time."""
    findings, warned = found(monkeypatch, drift_ppm=-150.0, measurement_s=sensor_findings.MEASUREMENT_S)
    assert warned <= {"Sensor clock"}  # where the computer that runs the tests stood still
    assert float(findings["Sensor rate"].value.split()[0]) == pytest.approx(4000, rel=0.15)
    assert findings["Sensor losses"].value.startswith("0 of ") and findings["Sensor losses"].fine
    drift_ppm, way = findings["Sensor clock"].value.split()[0], findings["Sensor clock"].value.split()[2]
    assert (float(drift_ppm), way) == (pytest.approx(150, abs=100), "fast")
    noise = [float(axis) for axis in findings["Sensor noise"].value.split(" m/s")[0].split(", ")]
    np.testing.assert_allclose(noise, [0.04, 0.04, 0.08], rtol=0.1)


def garbled(block: bytes) -> bytes:
    """One bit of every second block."""
    garbled.turn = not getattr(garbled, "turn", False)
    return bytes([*block[:9], block[9] ^ 1, *block[10:]]) if garbled.turn else block


@pytest.mark.parametrize(
    ("board", "name", "says", "do"),
    [
        ({"rate_hz": 1000.0}, "Sensor rate", "samples per second", "PERIOD_US"),
        ({"spoil": garbled}, "Sensor losses", "packets lost, torn or garbled", "short cable"),
        ({"drift_ppm": 3000.0, "measurement_s": 1.5}, "Sensor clock", "ppm slow", "microseconds"),
        ({"noise_mps2": (0.04, 0.04, 1.0)}, "Sensor noise", "rms at rest", "capacitors"),
        ({"noise_mps2": (0.04, 0.0, 0.08)}, "Sensor noise", "does not move at all", "wire"),
    ],
)
def test_what_is_wrong_is_a_warning_that_says_what_to_do(monkeypatch, board, name, says, do):
    findings, warned = found(monkeypatch, **board)
    assert name in warned and warned <= {name, "Sensor clock"}
    assert says in findings[name].value and do in findings[name].advice
