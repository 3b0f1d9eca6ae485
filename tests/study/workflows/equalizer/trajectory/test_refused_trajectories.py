"""Tables and models that do not go together are refused by name; and what is said of those that do."""

from dataclasses import replace

import numpy as np
import pytest

from equalizer.plant.model_quality import ModelQuality
from study.errors import StudyError, WrongUseError
from study.store.disk.file_errors import CannotReadError, UnusableFileError
from study.store.formats.identified_model_file import write_identified_model
from study.store.formats.trajectory_file import write_trajectory
from study.workflows.equalizer.equalize_trajectory import equalize_trajectory
from study.workflows.equalizer.equalized_summary import format_equalization_lines, summarise_equalization
from tests.study.workflows.equalizer.trajectory.plans import model_of, noise, refusal, table, with_models


@pytest.mark.slow
def test_nothing_in_the_band_is_refused(plants, plan, tmp_path):
    write_trajectory(tmp_path / "high.csv", table(noise(plants, 80.0, 120.0)))
    high = replace(plan, trajectory=tmp_path / "high.csv")
    assert "the reference has no content from 5 to 35 Hz" in refusal(high).happened
    assert "the reference has no content" in refusal(with_models(high, "wide", "centre")).happened


def test_another_rate_is_refused(plants, plan, tmp_path):
    write_trajectory(tmp_path / "slow.csv", table(noise(plants), 500.0))
    assert "the rows are at 500 Hz" in refusal(replace(plan, trajectory=tmp_path / "slow.csv")).happened


def test_forces_are_no_accelerations(plants, plan, tmp_path):
    write_trajectory(tmp_path / "f.csv", table(noise(plants), kind="force"))
    refused = refusal(replace(plan, trajectory=tmp_path / "f.csv"), WrongUseError)
    assert "its header must be time_s,ax,ay,az" in refused.happened


def test_unusable_tables_and_missing_files_are_named(plan, tmp_path):
    text = plan.trajectory.read_text().splitlines()
    (tmp_path / "nan.csv").write_text("\n".join([*text[:5], "0.504,nan,0,0", *text[6:]]))
    assert "Line 6 reads" in refusal(replace(plan, trajectory=tmp_path / "nan.csv"), UnusableFileError).happened
    (tmp_path / "head.csv").write_text("\n".join(["t,x,y,z", *text[1:]]))
    assert (
        "Line 1 reads 't,x,y,z'" in refusal(replace(plan, trajectory=tmp_path / "head.csv"), UnusableFileError).happened
    )
    refusal(replace(plan, models=(tmp_path / "none.h5",)), CannotReadError)
    refusal(replace(plan, trajectory=tmp_path / "none.csv"), CannotReadError)
    refusal(replace(plan, physics=tmp_path / "none.toml"), CannotReadError)


def test_models_that_cannot_play_a_table_are_refused(plants, plan, tmp_path):
    good = model_of(plants.omega_like(0.1))
    wrong = {
        "turned.h5": (replace(good, input_channels=("fy", "fx", "fz")), "a table needs a model from fx, fy, fz in N"),
        "torques.h5": (replace(good, input_unit="N m"), "goes from fx, fy, fz in N m to ax, ay, az in m/s^2"),
        "unstable.h5": (replace(good, A=good.A * 1.1 / good.spectral_radius), "is not stable (slowest pole 1.1"),
    }
    for name, (model, said) in wrong.items():
        write_identified_model(tmp_path / name, model)
        assert said in refusal(replace(plan, models=(tmp_path / name,))).happened


@pytest.mark.parametrize("names", [(("x", "y", "z"), ("AX", "AY", "AZ")), (("u1", "u2", "u3"), ("0", "1", "2"))])
def test_channels_may_be_named_otherwise(plants, plan, tmp_path, names):
    named = replace(model_of(plants.omega_like(0.1)), input_channels=names[0], output_channels=names[1])
    write_identified_model(tmp_path / "named.h5", named)
    ours = equalize_trajectory(plan)
    theirs = equalize_trajectory(replace(plan, models=(tmp_path / "named.h5",), out=tmp_path / "theirs.csv"))
    np.testing.assert_array_equal(theirs.forces.signal.samples, ours.forces.signal.samples)


def test_models_that_do_not_go_together_are_refused(plants, plan, tmp_path):
    good = model_of(plants.omega_like(0.1), (0.03, 0.0, 0.0))
    wrong = {
        "rate.h5": (replace(good, sample_rate_hz=500.0), "sample rate"),
        "nowhere.h5": (replace(good, place_m=None), "does not say where it was identified"),
        "spring.h5": (replace(good, provenance={"input": "excitation"}), "ome models include the spring"),
    }
    for name, (model, said) in wrong.items():
        write_identified_model(tmp_path / name, model)
        refused = refusal(replace(plan, models=(plan.models[0], tmp_path / name), at_m=(0.01, 0.0, 0.0)))
        assert said in refused.happened
        assert f"2: {name}" in refused.happened


def test_two_rates_of_one_place_are_refused(plants, plan, tmp_path):
    other = replace(model_of(plants.omega_like(0.1)), sample_rate_hz=500.0, band_hz=(5.0, 200.0))
    write_identified_model(tmp_path / "slow.h5", other)
    assert "at 1000 and 500 Hz" in refusal(replace(plan, models=(plan.models[0], tmp_path / "slow.h5"))).happened


def test_nothing_is_overwritten_and_folders_are_not_made(plan, tmp_path):
    plan.out.write_text("mine")
    with pytest.raises(StudyError, match="never overwritten"):
        equalize_trajectory(plan)
    assert plan.out.read_text() == "mine"
    assert "There is no folder" in refusal(replace(plan, out=tmp_path / "no" / "forces.csv")).happened


def test_what_was_measured_of_the_model_comes_before_what_it_predicts(plants, plan, tmp_path):
    quality = ModelQuality(0.13, 0.12, 0.001, 0.13, 0.004, 10.0, ("A pole is at the bound of the decay.",))
    write_identified_model(tmp_path / "poor.h5", model_of(plants.omega_like(), quality=quality))
    done = equalize_trajectory(replace(plan, models=(tmp_path / "poor.h5",)))
    first, cause, predicted, *_ = format_equalization_lines(done)
    assert first == (
        "Measured on 10 s held out for a test, the error of the model is 13.00 %, noise of the record 0.40 %; "
        "expected error, exceeded in 5 % of cases: 13.00 %."
    )
    assert cause == "A pole is at the bound of the decay."
    assert predicted.startswith("As the model itself predicts: error 0.")
    assert list(summarise_equalization(done))[1] == "quality"
    assert summarise_equalization(done)["quality"]["held_out_error"] == 0.13


def test_of_several_models_the_nearest_and_the_worst_are_reported(plants, plan, tmp_path):
    near, far = ModelQuality(0.01, 0.01), ModelQuality(0.2, 0.1, None, 0.2, None, 5.0)
    write_identified_model(tmp_path / "near.h5", model_of(plants.omega_like(), (0.0, 0.0, 0.0), quality=near))
    write_identified_model(tmp_path / "far.h5", model_of(plants.omega_like(0.05), (0.03, 0.0, 0.0), quality=far))
    models = (tmp_path / "near.h5", tmp_path / "far.h5")
    done = equalize_trajectory(replace(plan, models=models, at_m=(0.005, 0.0, 0.0)))
    first, second, *_ = format_equalization_lines(done)
    assert first.startswith("Of the nearest model: No recording was held out for a test")
    assert second.startswith(
        "Of the worst of the 2 models: Measured on 5 s held out for a test, the error of the model is 20.00 %"
    )
    assert summarise_equalization(done)["quality"]["expected_error"] == 0.2
