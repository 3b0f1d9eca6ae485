"""`hapteq calibrate`, and what goes on with its file."""

import json

import numpy as np
import pytest

from study.cli.main import main
from study.errors import ExitCode
from study.store.formats.calibration_file import read_calibration
from study.store.formats.recording_file import read_recording


@pytest.fixture
def path(tmp_path, capsys):
    path = tmp_path / "cal.h5"
    assert main(["calibrate", "--out", str(path)]) == ExitCode.DONE
    assert "185 positions read, 0 filled in" in capsys.readouterr().out
    return path


def test_results_as_one_document(tmp_path, capsys):
    out = tmp_path / "cal.h5"
    assert main(["calibrate", "--out", str(out), "--radius", "0.03", "--depth", "0.02", "--json"]) == ExitCode.DONE
    told = json.loads(capsys.readouterr().out)
    assert told["positions"] == {"read": 185, "filled": 0, "unknown": 0} and told["warnings"] == []
    np.testing.assert_allclose(told["centre"]["inertia_kg"], 0.2823 * np.eye(3), atol=1e-3)
    assert len(told["lines"]) == 3 and np.abs(read_calibration(out).position_m).max() <= 0.03 + 1e-12


def test_beyond_the_stops_positions_stay_unknown_and_are_counted(tmp_path, capsys):
    out = tmp_path / "cal.h5"
    assert main(["calibrate", "--out", str(out), "--radius", "0.06", "--depth", "0.05", "--json"]) == ExitCode.DONE
    positions = json.loads(capsys.readouterr().out)["positions"]
    assert positions["unknown"] == 24 and positions["read"] + positions["unknown"] == 185


def test_a_file_is_never_overwritten(path, capsys):
    before = path.read_bytes()
    assert main(["calibrate", "--out", str(path)]) == ExitCode.ERROR
    assert "never overwritten" in capsys.readouterr().err and path.read_bytes() == before


@pytest.mark.slow
def test_a_recording_is_made_on_the_device_of_a_calibration(path, tmp_path, capsys):
    """Of its own calibration, the simulated device is itself: the same samples to rounding."""
    outs = [tmp_path / "own.h5", tmp_path / "as_calibrated.h5"]
    for out, device in zip(outs, ("simulated", f"simulated:{path}"), strict=True):
        assert main(["record", "ellipsoid", "--device", device, "--out", str(out)]) == ExitCode.DONE
    own, again = (read_recording(out).response.samples for out in outs)
    np.testing.assert_allclose(again, own, atol=1e-3 * np.nanmax(np.abs(own)))


def test_a_device_of_another_file_is_refused(tmp_path, capsys):
    other = tmp_path / "other.h5"
    other.write_bytes(b"no calibration")
    arguments = ["record", "ellipsoid", "--device", f"simulated:{other}", "--out", str(tmp_path / "r.h5")]
    assert main(arguments) == ExitCode.ERROR
    assert "calibration of a linkage" in capsys.readouterr().err
