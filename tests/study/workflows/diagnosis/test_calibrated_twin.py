"""A twin with a calibration: the simulated device has its linkage, and the model says how the inertia changes."""

import json

import numpy as np
import pytest

from study.cli.main import main
from study.devices.simulated.simulated_linkage import make_simulated_linkage
from study.errors import ExitCode, StudyError
from study.store.formats.calibration_file import write_calibration
from study.store.formats.mechanical_model_file import read_mechanical_model
from study.workflows.diagnosis.write_twin import TwinPlan, write_twin
from study.workflows.recording.calibrate_linkage import CalibrationPlan, calibrate_linkage
from tests.equalizer.linkage.truth import calibration, readings
from tests.study.workflows.diagnosis.test_write_twin import SEGMENT, SHORT

pytestmark = pytest.mark.usefixtures("validated_here")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("calibrated")
    segments = (SEGMENT.format(along=a, to_hz=26.0, duration_s=2.0, seed=i) for i, a in enumerate("xyz"))
    (folder / "shorter.toml").write_text(SHORT + "".join(segments))
    calibrate_linkage(CalibrationPlan(folder / "cal.h5"), lambda share: None)
    return folder


@pytest.mark.slow
def test_the_model_says_how_the_inertia_changes_along_each_axis(folder, capsys):
    out = folder / "m.toml"
    asked = ["--protocol", str(folder / "shorter.toml"), "--band", "2", "25", "--seed", "2", "--json"]
    assert main(["twin", "--out", str(out), "--calibration", str(folder / "cal.h5"), *asked]) == ExitCode.DONE
    said = json.loads(capsys.readouterr().out)
    model = read_mechanical_model(out)
    assert model.name == "simulated omega.3 as calibrated, as identified"
    # Along y it does not change: the plane across it, through the upright arm, is a mirror.
    assert [(effect.kind, effect.axis) for effect in model.effects] == [
        ("pose_dependent_inertia", "x"), ("pose_dependent_inertia", "z"),
    ]  # fmt: skip
    linkage, step = make_simulated_linkage(), 1e-4
    for effect, axis in zip(model.effects, (0, 2), strict=True):
        aside = step * np.eye(3)[axis]
        before, after = (linkage.compute_reading_at(sign * aside).inertia_kg[axis, axis] for sign in (-1, 1))
        driven_kg = model.mass[axis, axis]
        assert effect.parameters["per_m"] * driven_kg == pytest.approx((after - before) / (2 * step), rel=0.02)
    assert any("0.282, 0.282, 0.282 kg at the centre; by the recordings" in note for note in said["notes"])
    assert model.provenance["parents"][0]["file"] == "cal.h5"
    assert main(["validate", str(out)]) == ExitCode.DONE


def test_the_calibration_of_another_device_is_refused(folder):
    """The device without friction stands for a real one here: the calibration must be of what was recorded."""
    other = folder / "other.h5"
    write_calibration(other, calibration(readings()))
    device = "simulated-frictionless"
    plan = TwinPlan(folder / "n.toml", device, protocol=str(folder / "shorter.toml"), calibration=other)
    with pytest.raises(
        StudyError, match="The calibration is of the invented; this is the simulated omega.3 without friction"
    ):
        write_twin(plan, lambda share: None)
    assert not plan.out.exists()
