"""Models of several places and bands play one table together."""

from dataclasses import replace

import numpy as np
import pytest

from equalizer.plant.model_quality import NOT_STORED
from equalizer.tracking.lqr.padding import compute_band_error
from study.errors import WrongUseError
from study.store.formats.trajectory_file import read_trajectory, write_trajectory
from study.workflows.equalizer.equalize_trajectory import equalize_trajectory
from study.workflows.equalizer.equalized_summary import format_equalization_lines, summarise_equalization
from tests.study.workflows.equalizer.trajectory.plans import RATE_HZ, noise, played_error, refusal, table, with_models


def test_models_of_several_places_need_a_place(plan):
    refused = refusal(with_models(plan, "left", "right"), WrongUseError)
    assert "left.h5 (−30, 0, 0) mm; right.h5 (30, 0, 0) mm" in refused.happened
    assert "--at X Y Z" in refused.do_now


def test_two_places_are_blended(plants, plan):
    blended = with_models(plan, "left", "right", at_m=(0.0, 0.0, 0.0))
    done = equalize_trajectory(blended)
    assert summarise_equalization(done)["interpolation"] == "blended forces"
    assert summarise_equalization(done)["held_out"] == []
    assert any(line.startswith("No place could be held out") for line in format_equalization_lines(done))
    error = played_error(plants, blended, 0.1)
    blended.out.unlink()
    equalize_trajectory(with_models(plan, "left"))
    assert error < 0.85 * played_error(plants, blended, 0.1)


@pytest.mark.slow
def test_three_places_are_checked_with_the_middle_one_held_out(plants, plan):
    between = with_models(plan, "left", "centre", "right", at_m=(0.015, 0.0, 0.0))
    done = equalize_trajectory(between)
    (check,) = summarise_equalization(done)["held_out"]
    assert check["place_m"] == [0.0, 0.0, 0.0]
    blended, modal = check["blended_held_out_error"], check["modal_held_out_error"]
    better = modal is not None and modal < blended
    assert summarise_equalization(done)["interpolation"] == ("modal" if better else "blended forces")
    measured, first, second, *_ = format_equalization_lines(done)
    assert measured == f"Of the nearest model: {NOT_STORED}"
    assert first.startswith(f"Held out (0, 0, 0) mm: error {100 * blended:.1f} % (rms over lines) with blended forces")
    assert second.startswith("As the models themselves predict: error")
    assert played_error(plants, between, 0.15) < 0.2


def test_a_place_outside_is_reported(plan):
    done = equalize_trajectory(with_models(plan, "left", "right", at_m=(0.05, 0.0, 0.0)))
    assert any("20.0 mm outside the points" in remark for remark in done.models.remarks)


def test_a_single_model_far_from_the_place_is_used_with_a_word(plan):
    done = equalize_trajectory(replace(plan, at_m=(0.02, 0.0, 0.0)))
    assert "centre.h5 was identified 20 mm from the place" in done.models.remarks[0]


def test_a_place_that_is_not_finite_is_refused(plan):
    assert "--at is nan, 0, 0" in refusal(replace(plan, at_m=(float("nan"), 0.0, 0.0)), WrongUseError).happened


@pytest.mark.slow
def test_blended_parts_are_capped_together(plan):
    loud = with_models(plan, "left", "right", at_m=(0.0, 0.0, 0.0), trajectory=plan.trajectory.with_name("loud.csv"))
    assert "above the cap of 3 N" in refusal(loud).happened
    equalize_trajectory(replace(loud, constrain=True))
    assert np.linalg.norm(read_trajectory(loud.out).signal.samples, axis=1).max() <= 3.0


@pytest.mark.slow
def test_a_narrow_and_a_wide_model_of_one_place_play_bands(plants, plan, tmp_path):
    write_trajectory(tmp_path / "wide.csv", table(noise(plants, 2.0, 200.0)))
    banded = with_models(plan, "wide", "centre", trajectory=tmp_path / "wide.csv")
    done = equalize_trajectory(banded)
    assert summarise_equalization(done)["bands"]["edges_hz"] == [4.0, 36.0]
    assert played_error(plants, banded, 0.1) < 0.06
    assert summarise_equalization(done)["bands"]["high_level_error"] < 0.1
    lines = format_equalization_lines(done)
    assert any(line.startswith("Bands: a rigid model below 4 Hz") for line in lines)
    assert any("simply cut off" in line for line in lines)
    assert any(line.startswith("Loudness of the high band") for line in lines)


@pytest.mark.slow
def test_the_cap_holds_for_all_bands_together(plants, plan, tmp_path):
    write_trajectory(tmp_path / "wide.csv", table(noise(plants, 3.0, 60.0, rms=1.5)[:1000]))
    free = with_models(plan, "wide", "centre", trajectory=tmp_path / "wide.csv", cap_n=50.0)
    cap_n = 0.9 * equalize_trajectory(free).peaks.peak_n
    free.out.unlink()
    banded = replace(free, cap_n=cap_n)
    assert f"above the cap of {cap_n:g} N" in refusal(banded).happened
    equalize_trajectory(replace(banded, constrain=True))
    assert np.linalg.norm(read_trajectory(banded.out).signal.samples, axis=1).max() <= cap_n * (1 + 1e-9)


def test_bands_that_do_not_add_up_are_refused(plan):
    assert "cannot be combined" in refusal(with_models(plan, "centre", "centre")).happened
    assert "3 models are of one place" in refusal(with_models(plan, "centre", "centre", "wide")).happened


def test_a_weight_that_bands_cannot_take_is_refused(plan):
    assert "weight is 0.5; it must be within" in refusal(with_models(plan, "wide", "centre", weight=0.5)).happened


def test_a_wide_model_alone_plays_its_whole_band(plants, plan, tmp_path):
    write_trajectory(tmp_path / "wide.csv", table(noise(plants, 6.0, 200.0, rms=0.5)))
    done = equalize_trajectory(with_models(plan, "wide", trajectory=tmp_path / "wide.csv"))
    assert done.bands is None
    assert done.feedforward.out_of_band_share < 0.03
    forces = read_trajectory(done.plan.out).signal.samples
    wanted = read_trajectory(tmp_path / "wide.csv").signal.samples
    assert compute_band_error(wanted, plants.omega_like(0.1).play(forces), RATE_HZ, (5.0, 200.0)) < 0.02
