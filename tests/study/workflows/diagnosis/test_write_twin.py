"""The twin is identified from the simulated device through the safety layer, and written as any mechanical model."""

import json
from pathlib import Path

import numpy as np
import pytest

from study.cli.main import main
from study.errors import ExitCode, StudyError, WrongUseError
from study.store.formats.mechanical_model_file import read_mechanical_model
from study.workflows.diagnosis.write_twin import TwinPlan, _fit_models, write_twin

pytestmark = pytest.mark.usefixtures("validated_here")

SEGMENT = """
[[segments]]
kind = "multisine"
role = "fit"
along = "{along}"
from_hz = 1.0
to_hz = {to_hz}
duration_s = {duration_s}
periods = 2
realisations = 2
odd_only = true
seed = {seed}
amplitude_n = 2.5
"""
SHORT = """
name = "short"
kind = "recording"
title = "Short multisines"
hand = "none"
rest_s = 0.5
repeats = 1
fade_s = 0.1

[spring]
natural_frequency_hz = 3.5

[safety]
stimulus_cap_n = 3.0
total_cap_n = 4.5
"""


@pytest.fixture(scope="module")
def protocol(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("twin") / "short.toml"
    path.write_text(
        SHORT + "".join(SEGMENT.format(along=a, to_hz=60.0, duration_s=4.0, seed=i) for i, a in enumerate("xyz"))
    )
    return path


@pytest.fixture(scope="module")
def twin(protocol):
    plan = TwinPlan(protocol.parent / "twin.toml", protocol=str(protocol), band_hz=(3.0, 60.0))
    shares: list[float] = []
    return plan, write_twin(plan, shares.append), shares


@pytest.mark.slow
def test_the_model_predicts_what_was_kept_for_a_test(twin):
    plan, written, _ = twin
    assert written.fit.held_out is not None and written.fit.held_out < 0.3
    model = read_mechanical_model(plan.out)
    np.testing.assert_array_equal(model.mass, written.model.mass)
    assert model.quantity == "acceleration" and model.inputs == model.outputs == 3
    assert model.sensor.bandwidth_hz == 500.0


@pytest.mark.slow
def test_what_friction_put_into_the_damping_is_taken_off_and_said(twin):
    written = twin[1]
    # The device's own, with its friction apart: 10.2 N s/m.
    left = np.diag(written.fit.model.damping - written.model.damping)[:3]
    np.testing.assert_allclose(left, written.rigid_body.friction_damping)
    assert (written.rigid_body.friction_damping > 4.0).all()
    np.testing.assert_allclose(written.rigid_body.damping - written.rigid_body.friction_damping, 10.2, rtol=0.4)
    assert any("were attributed to friction and subtracted" in note for note in written.notes)


@pytest.mark.slow
def test_the_model_is_a_few_bodies_with_tolerances_as_a_laboratory_states_them(twin):
    model = twin[1].model
    assert model.coordinates <= 12
    carried = model.mass[:3, :3] + model.mass[3:6, 3:6]
    np.testing.assert_allclose(np.diag(carried), 0.282, rtol=0.12)
    tolerance = model.tolerance
    assert tolerance is not None and tolerance.mass_kg is not None and tolerance.stiffness_n_per_m is not None
    assert tolerance.mass_kg < 0.03 and tolerance.stiffness_n_per_m < 50.0


@pytest.mark.slow
def test_the_spring_is_said_to_be_in_the_command(twin):
    assert any("virtual spring of 137 N/m" in note for note in twin[1].notes)
    assert twin[1].model.provenance["from"] == "command, the virtual spring's force in it"


@pytest.mark.slow
def test_progress_rises_to_one(twin):
    shares = twin[2]
    assert shares == sorted(shares) and shares[-1] == 1.0


@pytest.mark.slow
def test_a_model_is_never_overwritten(twin):
    plan = twin[0]
    before = plan.out.read_bytes()
    with pytest.raises(StudyError, match="never overwritten"):
        write_twin(plan, lambda share: None)
    assert plan.out.read_bytes() == before


def test_a_band_that_falls_is_refused_before_anything_moves(protocol, tmp_path):
    with pytest.raises(WrongUseError, match="it must rise"):
        write_twin(TwinPlan(tmp_path / "m.toml", protocol=str(protocol), band_hz=(9.0, 2.0)), lambda share: None)


def test_a_protocol_that_leaves_an_axis_still_is_refused(tmp_path):
    path = tmp_path / "x.toml"
    path.write_text(SHORT + SEGMENT.format(along="x", to_hz=40.0, duration_s=4.0, seed=1))
    with pytest.raises(WrongUseError, match="multisines along x, y and z"):
        write_twin(TwinPlan(tmp_path / "m.toml", protocol=str(path)), lambda share: None)


def test_a_band_without_lines_is_refused_and_nothing_is_written(protocol, tmp_path):
    out = tmp_path / "m.toml"
    with pytest.raises(StudyError, match="fewer than eight lines"):
        write_twin(TwinPlan(out, protocol=str(protocol), band_hz=(200.0, 300.0)), lambda share: None)
    assert not out.exists()


@pytest.mark.slow
def test_the_command_writes_a_model_and_says_what_it_is(tmp_path, capsys):
    protocol, out = tmp_path / "shorter.toml", tmp_path / "m.toml"
    segments = (SEGMENT.format(along=a, to_hz=26.0, duration_s=2.0, seed=i) for i, a in enumerate("xyz"))
    protocol.write_text(SHORT + "".join(segments))
    arguments = ["twin", "--out", str(out), "--protocol", str(protocol), "--band", "2", "25", "--seed", "2", "--json"]
    assert main(arguments) == ExitCode.DONE
    said = json.loads(capsys.readouterr().out)
    assert said["held_out"] < 0.5 and len(said["channels"]) == 3
    assert main(arguments) == ExitCode.ERROR
    assert "never overwritten" in capsys.readouterr().err
    assert main(["validate", str(out)]) == ExitCode.DONE


def test_a_fit_that_breaks_down_is_refused_as_any_other(monkeypatch, tmp_path):
    def break_down(*_):
        raise np.linalg.LinAlgError("Eigenvalues did not converge")

    monkeypatch.setattr("study.workflows.diagnosis.write_twin.fit_mechanical_model", break_down)
    with pytest.raises(StudyError, match="Eigenvalues did not converge"):
        _fit_models(TwinPlan(tmp_path / "m.toml"), None, None, lambda _: None)
