"""Tables of accelerations through models of the synthetic device, whose answer is known."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from equalizer.plant.effect_vocabulary import EFFECT_NAMES
from equalizer.plant.identified_model import IdentifiedModel
from equalizer.plant.mechanical_model import MechanicalModel, ModelEffect
from equalizer.plant.model_quality import NOT_STORED, ModelQuality
from equalizer.signals.signal import Signal
from equalizer.tracking.feedforward.trajectory import Trajectory
from equalizer.tracking.lqr.padding import band_error
from study.errors import StudyError, WrongUseError
from study.store.disk.file_errors import CannotReadError, UnusableFileError
from study.store.formats.identified_model_file import write_identified_model
from study.store.formats.mechanical_model_file import write_mechanical_model
from study.store.formats.trajectory_file import read_trajectory, write_trajectory
from study.workflows.equalizer.equalize_trajectory import EqualizePlan, equalize_trajectory
from study.workflows.equalizer.equalized_summary import summary, summary_lines

RATE_HZ, BAND_HZ = 1000.0, (5.0, 35.0)
PLACES = {"left": ((-0.03, 0.0, 0.0), 0.0), "centre": ((0.0, 0.0, 0.0), 0.1), "right": ((0.03, 0.0, 0.0), 0.2)}
"""With the share by which resonances have moved there."""


def table(samples, rate_hz=RATE_HZ, kind="acceleration") -> Trajectory:
    unit, channels = ("N", ("fx", "fy", "fz")) if kind == "force" else ("m/s^2", ("ax", "ay", "az"))
    return Trajectory(Signal(samples, rate_hz, kind, unit, channels), 0.5)


def model_of(plant, place_m=(0.0, 0.0, 0.0), band_hz=BAND_HZ, **more) -> IdentifiedModel:
    channels = ("fx", "fy", "fz"), ("ax", "ay", "az")
    facts = {"place_m": place_m, "provenance": {"amplitude_n": 1.0}, **more}
    return IdentifiedModel(
        plant.A, plant.B, plant.C, np.zeros((3, 3)), RATE_HZ, band_hz, "N", "m/s^2", *channels, **facts
    )


def noise(plants, low_hz=5.5, high_hz=34.5, rms=1.0, seed=99) -> np.ndarray:
    rest_to_rest = np.sin(np.pi * np.arange(2000) / 2000)[:, None] ** 2
    return plants.multisine(low_hz, high_hz, seconds=2.0, rms=rms, seed=seed) * rest_to_rest


@pytest.fixture(scope="module")
def folder(plants, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("equalize")
    for name, (place_m, shift) in PLACES.items():
        write_identified_model(folder / f"{name}.h5", model_of(plants.omega_like(shift), place_m))
    middle = PLACES["centre"]
    write_identified_model(folder / "wide.h5", model_of(plants.omega_like(middle[1]), middle[0], (5.0, 400.0)))
    write_trajectory(folder / "wanted.csv", table(noise(plants)))
    write_trajectory(folder / "loud.csv", table(noise(plants, rms=3.5)[600:1400]))
    return folder


@pytest.fixture
def plan(folder, tmp_path) -> EqualizePlan:
    return EqualizePlan((folder / "centre.h5",), folder / "wanted.csv", tmp_path / "forces.csv")


def with_models(plan: EqualizePlan, *names: str, **more) -> EqualizePlan:
    return replace(plan, models=tuple(plan.models[0].with_name(f"{name}.h5") for name in names), **more)


def played_error(plants, plan, shift) -> float:
    wanted, forces = read_trajectory(plan.trajectory).signal.samples, read_trajectory(plan.out).signal.samples
    return band_error(wanted, plants.omega_like(shift).play(forces), RATE_HZ, BAND_HZ)


def refusal(plan, error=StudyError) -> StudyError:
    with pytest.raises(error) as caught:
        equalize_trajectory(plan)
    assert not plan.out.exists()
    assert caught.value.do_now
    return caught.value


def test_the_forces_of_a_table_make_the_device_do_it_row_by_row(plants, plan):
    done = equalize_trajectory(plan)
    forces = read_trajectory(plan.out)
    assert len(forces.signal) == 2000
    assert forces.start_s == 0.5
    assert played_error(plants, plan, 0.1) < 0.01
    assert done.solved.error < 0.01
    measured, predicted, *_ = summary_lines(done)
    assert measured == NOT_STORED
    assert predicted.startswith("As the model itself predicts") and predicted.endswith("N of 3 N.")
    assert "a spring that holds the handle is not counted" in summary_lines(done)[-1]
    assert summary(done)["peak_n"] <= 3.0


def test_what_is_left_out_is_said(plants, plan, tmp_path):
    t = np.arange(2000)[:, None] / RATE_HZ
    write_trajectory(tmp_path / "whistle.csv", table(noise(plants) + np.sin(2 * np.pi * 84 * t)))
    done = equalize_trajectory(replace(plan, trajectory=tmp_path / "whistle.csv"))
    assert 0.3 < summary(done)["left_out"] < 0.9
    assert any("lies outside the band and is not played" in line for line in summary_lines(done))


def test_too_strong_forces_are_refused_with_the_factor_or_solved_under_the_cap(plan):
    loud = replace(plan, trajectory=plan.trajectory.with_name("loud.csv"))
    refused = refusal(loud)
    assert refused.title == "The forces would be too strong"
    assert "fits when scaled by 0." in refused.happened
    done = equalize_trajectory(replace(loud, constrain=True))
    assert np.linalg.norm(read_trajectory(loud.out).signal.samples, axis=1).max() <= 3.0
    assert summary(done)["capped"]["error_capped"] > summary(done)["capped"]["error_free"]
    assert any("held at the cap have corners" in line for line in summary_lines(done))


def test_what_the_cap_costs_is_said_in_one_figure(plan):
    done = equalize_trajectory(replace(plan, trajectory=plan.trajectory.with_name("loud.csv"), constrain=True))
    capped, lines = summary(done)["capped"], summary_lines(done)
    assert summary(done)["predicted_error"] == capped["error_capped"]
    assert sum(" error " in line for line in lines) == 1
    figures = [100 * capped[f"error_{kind}"] for kind in ("capped", "free", "clipped")]
    assert "error {:.2f} % of what is wanted".format(*figures) in lines[1]
    assert "under the cap, {1:.2f} % without it (clipping would have given {2:.2f} %)".format(*figures) in lines[1]


@pytest.mark.parametrize("rows", [[0.0, 0.0, 0.0], [1e-7, 1e-7, 1e-7], [1.0, 0.0, 0.0]])
@pytest.mark.parametrize("constrain", [False, True])
def test_a_model_that_does_not_answer_is_refused(plants, plan, tmp_path, rows, constrain):
    good = model_of(plants.omega_like(0.1))
    write_identified_model(tmp_path / "deaf.h5", replace(good, C=np.array(rows)[:, None] * good.C))
    refused = refusal(replace(plan, models=(tmp_path / "deaf.h5",), constrain=constrain))
    assert "By the model itself the best forces would miss" in refused.happened
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
    assert refused.happened == "With --weight 0 nothing keeps forces finite that the model hardly answers."
    assert refused.do_now == "Give a weight above zero, such as --weight 0.001."


@pytest.mark.parametrize("size", [1e5, -1e300])
def test_an_acceleration_that_cannot_be_meant_is_named_with_its_line(plants, plan, tmp_path, size):
    samples = noise(plants)
    samples[500, 1] = size
    write_trajectory(tmp_path / "slip.csv", table(samples))
    refused = refusal(replace(plan, trajectory=tmp_path / "slip.csv"))
    assert refused.happened.startswith(f"slip.csv wants {size:g} m/s^2 of ay in line 502; no more than 10000 m/s^2")


def test_models_of_several_places_need_a_place(plan):
    refused = refusal(with_models(plan, "left", "right"), WrongUseError)
    assert "left.h5 (−30, 0, 0) mm; right.h5 (30, 0, 0) mm" in refused.happened
    assert "--at X Y Z" in refused.do_now


def test_two_places_are_blended(plants, plan):
    blended = with_models(plan, "left", "right", at_m=(0.0, 0.0, 0.0))
    done = equalize_trajectory(blended)
    assert summary(done)["interpolation"] == "blended forces"
    assert summary(done)["held_out"] == []
    assert any(line.startswith("No place could be held out") for line in summary_lines(done))
    error = played_error(plants, blended, 0.1)
    blended.out.unlink()
    equalize_trajectory(with_models(plan, "left"))
    assert error < 0.85 * played_error(plants, blended, 0.1)


def test_three_places_are_checked_with_the_middle_one_held_out(plants, plan):
    between = with_models(plan, "left", "centre", "right", at_m=(0.015, 0.0, 0.0))
    done = equalize_trajectory(between)
    (check,) = summary(done)["held_out"]
    assert check["place_m"] == [0.0, 0.0, 0.0]
    blended, modal = check["blended_held_out_error"], check["modal_held_out_error"]
    better = modal is not None and modal < blended
    assert summary(done)["interpolation"] == ("modal" if better else "blended forces")
    measured, first, second, *_ = summary_lines(done)
    assert measured == f"Of the nearest model: {NOT_STORED}"
    assert first.startswith(f"Held out (0, 0, 0) mm: error {100 * blended:.1f} % (rms over lines) with blended forces")
    assert second.startswith("As the models themselves predict: error")
    assert played_error(plants, between, 0.15) < 0.2


def test_a_place_outside_is_said(plan):
    done = equalize_trajectory(with_models(plan, "left", "right", at_m=(0.05, 0.0, 0.0)))
    assert any("20.0 mm outside the points" in remark for remark in done.models.remarks)


def test_a_single_model_far_from_the_place_is_used_with_a_word(plan):
    done = equalize_trajectory(replace(plan, at_m=(0.02, 0.0, 0.0)))
    assert "centre.h5 was identified 20 mm from the place" in done.models.remarks[0]


def test_a_place_that_is_no_number_is_refused(plan):
    assert "--at is nan, 0, 0" in refusal(replace(plan, at_m=(float("nan"), 0.0, 0.0)), WrongUseError).happened


def test_blended_parts_are_capped_together(plan):
    loud = with_models(plan, "left", "right", at_m=(0.0, 0.0, 0.0), trajectory=plan.trajectory.with_name("loud.csv"))
    assert "above the cap of 3 N" in refusal(loud).happened
    equalize_trajectory(replace(loud, constrain=True))
    assert np.linalg.norm(read_trajectory(loud.out).signal.samples, axis=1).max() <= 3.0


def test_a_narrow_and_a_wide_model_of_one_place_play_bands(plants, plan, tmp_path):
    write_trajectory(tmp_path / "wide.csv", table(noise(plants, 2.0, 200.0)))
    banded = with_models(plan, "wide", "centre", trajectory=tmp_path / "wide.csv")
    done = equalize_trajectory(banded)
    assert summary(done)["bands"]["edges_hz"] == [4.0, 36.0]
    assert played_error(plants, banded, 0.1) < 0.06
    assert summary(done)["bands"]["high_level_error"] < 0.1
    lines = summary_lines(done)
    assert any(line.startswith("Bands: a rigid model below 4 Hz") for line in lines)
    assert any("only cut off" in line for line in lines)
    assert any(line.startswith("Loudness of the high band") for line in lines)


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
    assert "do not add up" in refusal(with_models(plan, "centre", "centre")).happened
    assert "3 models are of one place" in refusal(with_models(plan, "centre", "centre", "wide")).happened


def test_a_weight_that_bands_cannot_take_is_refused(plan):
    assert "weight is 0.5; it must be within" in refusal(with_models(plan, "wide", "centre", weight=0.5)).happened


def test_a_wide_model_alone_plays_its_whole_band(plants, plan, tmp_path):
    write_trajectory(tmp_path / "wide.csv", table(noise(plants, 6.0, 200.0, rms=0.5)))
    done = equalize_trajectory(with_models(plan, "wide", trajectory=tmp_path / "wide.csv"))
    assert done.bands is None
    assert done.solved.left_out < 0.03
    forces = read_trajectory(done.plan.out).signal.samples
    wanted = read_trajectory(tmp_path / "wide.csv").signal.samples
    assert band_error(wanted, plants.omega_like(0.1).play(forces), RATE_HZ, (5.0, 200.0)) < 0.02


def mechanism(*effects: ModelEffect) -> MechanicalModel:
    eye = np.eye(3)
    return MechanicalModel("bench", "acceleration", 0.28 * eye, 5.0 * eye, 130.0 * eye, eye, eye, effects=effects)


def test_named_friction_is_compensated_and_what_is_linear_is_not(plan, tmp_path):
    friction = ModelEffect("coulomb_friction", None, {"level": 0.1})
    write_mechanical_model(
        tmp_path / "improved.toml", mechanism(friction, ModelEffect("added_mass", None, {"mass": 0.02}))
    )
    alone = equalize_trajectory(plan).forces.signal.samples
    plan.out.unlink()
    done = equalize_trajectory(replace(plan, physics=tmp_path / "improved.toml"))
    added = done.forces.signal.samples - alone
    assert 0.01 < np.abs(added).max() < 0.2
    assert summary(done)["compensated"] == ["coulomb_friction"]
    assert "it is linear" in summary(done)["not_compensated"]["added_mass"]
    assert "Compensated: coulomb_friction." in summary_lines(done)


def test_whatever_a_diagnosis_names_is_accepted_and_compensated_or_said(plan, tmp_path):
    named = tuple(
        ModelEffect(
            effect.name,
            "z" if effect.name == "sensor_lag" else None,
            {part.name: 0.7 if part.name == "gain" else 0.01 for part in effect.parameters},
        )
        for effect in EFFECT_NAMES
    )
    write_mechanical_model(tmp_path / "improved.toml", mechanism(*named))
    told = summary(equalize_trajectory(replace(plan, physics=tmp_path / "improved.toml")))
    assert {*told["compensated"], *told["not_compensated"]} == {effect.name for effect in EFFECT_NAMES}
    assert all(told["not_compensated"].values())


def test_the_cap_holds_for_the_sum_and_the_share_that_fits_is_said(plan, tmp_path):
    write_mechanical_model(tmp_path / "f.toml", mechanism(ModelEffect("coulomb_friction", None, {"level": 0.2})))
    peak_n = equalize_trajectory(plan).peaks.peak_n
    plan.out.unlink()
    done = equalize_trajectory(replace(plan, physics=tmp_path / "f.toml", cap_n=1.01 * peak_n))
    assert done.peaks.peak_n <= 1.01 * peak_n * (1 + 1e-9)
    assert 0 <= summary(done)["compensated_share"] < 1
    assert any("of it fits under the cap" in line for line in summary_lines(done))


def test_a_model_that_hides_its_amplitude_gets_no_friction_on_top(plants, plan, tmp_path):
    write_identified_model(tmp_path / "m.h5", model_of(plants.omega_like(0.1), provenance={}))
    write_mechanical_model(tmp_path / "f.toml", mechanism(ModelEffect("coulomb_friction", None, {"level": 0.1})))
    refused = refusal(replace(plan, models=(tmp_path / "m.h5",), physics=tmp_path / "f.toml"))
    assert refused.title == "Known physics cannot be compensated with this model"


def test_an_effect_on_an_axis_that_is_not_there_is_refused(plan, tmp_path):
    write_mechanical_model(tmp_path / "f.toml", mechanism(ModelEffect("coulomb_friction", "q", {"level": 0.1})))
    refused = refusal(replace(plan, physics=tmp_path / "f.toml"))
    assert refused.title == "The known physics do not go with the model"
    assert "on the axis 'q'" in refused.happened


def test_nothing_in_the_band_is_refused(plants, plan, tmp_path):
    write_trajectory(tmp_path / "high.csv", table(noise(plants, 80.0, 120.0)))
    high = replace(plan, trajectory=tmp_path / "high.csv")
    assert "nothing is wanted between 5 and 35 Hz" in refusal(high).happened
    assert "nothing is wanted" in refusal(with_models(high, "wide", "centre")).happened


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
        "spring.h5": (replace(good, provenance={"input": "excitation"}), "ome models hold the spring"),
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
    quality = ModelQuality(0.13, 0.12, 0.001, 0.13, 0.004, 10.0, ("A pole sits on the bound of the decay.",))
    write_identified_model(tmp_path / "poor.h5", model_of(plants.omega_like(), quality=quality))
    done = equalize_trajectory(replace(plan, models=(tmp_path / "poor.h5",)))
    first, cause, predicted, *_ = summary_lines(done)
    assert first == (
        "Measured on 10 s kept for a test, the model errs by 13.00 %, noise of the record 0.40 %; expected with misfit "
        "and scatter: 13.00 %."
    )
    assert cause == "A pole sits on the bound of the decay."
    assert predicted.startswith("As the model itself predicts: error 0.")
    assert list(summary(done))[1] == "quality"
    assert summary(done)["quality"]["held_out_error"] == 0.13


def test_of_several_models_the_nearest_and_the_worst_are_said(plants, plan, tmp_path):
    near, far = ModelQuality(0.01, 0.01), ModelQuality(0.2, 0.1, None, 0.2, None, 5.0)
    write_identified_model(tmp_path / "near.h5", model_of(plants.omega_like(), (0.0, 0.0, 0.0), quality=near))
    write_identified_model(tmp_path / "far.h5", model_of(plants.omega_like(0.05), (0.03, 0.0, 0.0), quality=far))
    models = (tmp_path / "near.h5", tmp_path / "far.h5")
    done = equalize_trajectory(replace(plan, models=models, at_m=(0.005, 0.0, 0.0)))
    first, second, *_ = summary_lines(done)
    assert first.startswith("Of the nearest model: No recording was kept for a test")
    assert second.startswith("Of the worst of the 2 models: Measured on 5 s kept for a test, the model errs by 20.00 %")
    assert summary(done)["quality"]["expected_error"] == 0.2
