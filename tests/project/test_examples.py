"""The worked examples of the docs run as they stand, and their notebooks are made from them."""

import runpy
import sys
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[2] / "docs" / "examples"
SCRIPTS = sorted(path for path in EXAMPLES.glob("*.py") if path.name != "notebooks.py")


def run(name: str) -> dict:
    return runpy.run_path(str(EXAMPLES / f"{name}.py"))


def test_each_notebook_is_what_its_script_gives(monkeypatch):
    monkeypatch.setattr(sys, "path", [str(EXAMPLES), *sys.path])
    made = runpy.run_path(str(EXAMPLES / "notebooks.py"), run_name="notebooks")
    assert made["examples"]() == SCRIPTS
    for script in SCRIPTS:
        assert script.with_suffix(".ipynb").read_text("utf-8") == made["notebook"](script.read_text("utf-8"))


def test_a_table_is_imported_by_its_header():
    found = run("import_own_data")["imported"].recording
    assert found.command.units == ("A",)
    assert found.response.units == ("rad",)
    assert found.sample_rate_hz == pytest.approx(500.0)


def test_a_protocol_is_written_and_a_wrong_one_refused(capsys):
    found = run("write_a_protocol")
    assert found["protocol"].stimulus.frequencies_hz == (10.0, 30.0)
    said = capsys.readouterr().out
    assert "wrong.toml has" in said
    assert "0.800 N, answered right" in said


def test_a_driver_of_ones_own_moves_its_handle_and_keeps_the_cap():
    """That it is a driver at all: `tests/contracts/test_device_contract.py`."""
    found = run("drive_own_device")
    assert 1.0 < found["moved_mm"] < 2.0
    assert "Nothing has moved" in found["refusal"]
    assert not found["library"].force_mn.any()


@pytest.mark.slow
def test_a_simulated_study_has_a_threshold_per_frequency():
    assert len(run("simulate_and_analyse")["results"].thresholds) >= 10


@pytest.mark.slow
def test_forces_for_a_wanted_acceleration_are_within_the_cap():
    forces = run("identify_and_equalize")["forces"]
    assert forces.error < 0.01
    assert abs(forces.forces.samples).max() < 3.0


@pytest.mark.slow
def test_the_friction_of_the_cart_is_named_with_its_level():
    effect = run("diagnose_a_recording")["found"].diagnosis.effects[0]
    assert effect.effect == "coulomb_friction"
    assert effect.parameters["level"].value == pytest.approx(0.6, rel=0.02)


@pytest.mark.slow
def test_a_law_of_ones_own_is_found():
    effect = run("add_an_effect")["found"].diagnosis.effects[0]
    assert effect.effect == "power_drag"
    assert effect.parameters["p0"].value == pytest.approx(4.1, rel=0.03)
    assert effect.parameters["p1"].value == pytest.approx(1.5, abs=0.02)
