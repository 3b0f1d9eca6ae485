"""From a table to forces: the device does it, under the cap, or it is refused."""

from dataclasses import replace

import numpy as np
import pytest

from equalizer.plant.model_quality import NOT_STORED
from study.store.formats.identified_model_file import write_identified_model
from study.store.formats.trajectory_file import read_trajectory, write_trajectory
from study.workflows.equalizer.equalize_trajectory import equalize_trajectory
from study.workflows.equalizer.equalized_summary import format_equalization_lines, summarise_equalization
from tests.study.workflows.equalizer.trajectory.plans import RATE_HZ, model_of, noise, played_error, refusal, table


def test_the_forces_of_a_table_make_the_device_do_it_row_by_row(plants, plan):
    done = equalize_trajectory(plan)
    forces = read_trajectory(plan.out)
    assert len(forces.signal) == 2000
    assert forces.start_s == 0.5
    assert played_error(plants, plan, 0.1) < 0.01
    assert done.feedforward.error < 0.01
    measured, predicted, *_ = format_equalization_lines(done)
    assert measured == NOT_STORED
    assert predicted.startswith("As the model itself predicts") and predicted.endswith("N of 3 N.")
    assert "a spring that holds the handle is not counted" in format_equalization_lines(done)[-1]
    assert summarise_equalization(done)["peak_n"] <= 3.0


def test_a_table_at_a_rate_that_is_no_whole_number_is_played(plants, plan, tmp_path):
    model = replace(model_of(plants.omega_like(0.1)), sample_rate_hz=999.7)
    write_identified_model(tmp_path / "odd.h5", model)
    write_trajectory(tmp_path / "odd.csv", table(noise(plants), 999.7))
    done = equalize_trajectory(replace(plan, models=(tmp_path / "odd.h5",), trajectory=tmp_path / "odd.csv"))
    assert done.feedforward.error < 0.01


def test_what_is_left_out_is_reported(plants, plan, tmp_path):
    t = np.arange(2000)[:, None] / RATE_HZ
    write_trajectory(tmp_path / "whistle.csv", table(noise(plants) + np.sin(2 * np.pi * 84 * t)))
    done = equalize_trajectory(replace(plan, trajectory=tmp_path / "whistle.csv"))
    assert 0.3 < summarise_equalization(done)["left_out"] < 0.9
    assert any("lies outside the band and is not played" in line for line in format_equalization_lines(done))


@pytest.mark.slow
def test_too_strong_forces_are_refused_with_the_factor_or_solved_under_the_cap(plan):
    loud = replace(plan, trajectory=plan.trajectory.with_name("loud.csv"))
    refused = refusal(loud)
    assert refused.title == "The forces would be too strong"
    assert "fits when scaled by 0." in refused.happened
    done = equalize_trajectory(replace(loud, constrain=True))
    assert np.linalg.norm(read_trajectory(loud.out).signal.samples, axis=1).max() <= 3.0
    assert summarise_equalization(done)["capped"]["error_capped"] > summarise_equalization(done)["capped"]["error_free"]
    assert any("held at the cap have corners" in line for line in format_equalization_lines(done))


@pytest.mark.slow
def test_what_the_cap_costs_is_reported_in_one_figure(plan):
    done = equalize_trajectory(replace(plan, trajectory=plan.trajectory.with_name("loud.csv"), constrain=True))
    capped, lines = summarise_equalization(done)["capped"], format_equalization_lines(done)
    assert summarise_equalization(done)["predicted_error"] == capped["error_capped"]
    assert sum(" error " in line for line in lines) == 1
    figures = [100 * capped[f"error_{kind}"] for kind in ("capped", "free", "clipped")]
    assert "error {:.2f} % of the wanted acceleration".format(*figures) in lines[1]
    assert "within 5 to 35 Hz, errors at all frequencies counted, under the cap, " in lines[1]
    assert "under the cap, {1:.2f} % without it (clipping would have given {2:.2f} %)".format(*figures) in lines[1]


@pytest.mark.parametrize("rows", [[0.0, 0.0, 0.0], [1e-7, 1e-7, 1e-7], [1.0, 0.0, 0.0]])
@pytest.mark.parametrize("constrain", [False, True])
def test_a_model_that_does_not_answer_is_refused(plants, plan, tmp_path, rows, constrain):
    good = model_of(plants.omega_like(0.1))
    write_identified_model(tmp_path / "deaf.h5", replace(good, C=np.array(rows)[:, None] * good.C))
    refused = refusal(replace(plan, models=(tmp_path / "deaf.h5",), constrain=constrain))
    assert "According to the model, the error of the best forces would be" in refused.happened
    assert "identify it again" in refused.do_now


@pytest.mark.parametrize("gain", [1e7, 1e200])
def test_a_model_of_a_handle_without_mass_is_refused(plants, plan, tmp_path, gain):
    good = model_of(plants.omega_like(0.1))
    write_identified_model(tmp_path / "huge.h5", replace(good, C=gain * good.C))
    refused = refusal(replace(plan, models=(tmp_path / "huge.h5",)))
    assert "By huge.h5 1 N accelerates the handle with up to" in refused.happened
    assert "Check the units" in refused.do_now


def test_without_a_weight_the_weight_is_named(plan):
    refused = refusal(replace(plan, weight=0.0))
    assert refused.happened == "--weight 0 is too small to keep forces finite where the model hardly moves."
    assert refused.do_now == "Give a weight above zero, such as --weight 0.001."


@pytest.mark.parametrize("size", [1e5, -1e300])
def test_an_acceleration_that_cannot_be_meant_is_named_with_its_line(plants, plan, tmp_path, size):
    samples = noise(plants)
    samples[500, 1] = size
    write_trajectory(tmp_path / "slip.csv", table(samples))
    refused = refusal(replace(plan, trajectory=tmp_path / "slip.csv"))
    assert refused.happened.startswith(f"slip.csv wants {size:g} m/s^2 of ay in line 502; the largest")
