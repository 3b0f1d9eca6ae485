"""What a diagnosis has named is compensated, or it is said why not."""

from dataclasses import replace

import numpy as np

from equalizer.plant.effect_vocabulary import EFFECT_ENTRIES
from equalizer.plant.mechanical_model import MechanicalModel, ModelEffect
from study.store.formats.identified_model_file import write_identified_model
from study.store.formats.mechanical_model_file import write_mechanical_model
from study.workflows.equalizer.equalize_trajectory import equalize_trajectory
from study.workflows.equalizer.equalized_summary import format_equalization_lines, summarise_equalization
from tests.study.workflows.equalizer.trajectory.plans import model_of, refusal


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
    assert summarise_equalization(done)["compensated"] == ["coulomb_friction"]
    assert "it is linear" in summarise_equalization(done)["not_compensated"]["added_mass"]
    assert "Compensated: coulomb_friction." in format_equalization_lines(done)


def test_each_effect_that_a_diagnosis_names_is_compensated_or_reported(plan, tmp_path):
    named = tuple(
        ModelEffect(
            effect.name,
            "z" if effect.name == "sensor_lag" else None,
            {part.name: 0.7 if part.name == "gain" else 0.01 for part in effect.parameters},
        )
        for effect in EFFECT_ENTRIES
    )
    write_mechanical_model(tmp_path / "improved.toml", mechanism(*named))
    told = summarise_equalization(equalize_trajectory(replace(plan, physics=tmp_path / "improved.toml")))
    assert {*told["compensated"], *told["not_compensated"]} == {effect.name for effect in EFFECT_ENTRIES}
    assert all(told["not_compensated"].values())


def test_the_cap_holds_for_the_sum_and_the_share_that_fits_is_reported(plan, tmp_path):
    write_mechanical_model(tmp_path / "f.toml", mechanism(ModelEffect("coulomb_friction", None, {"level": 0.2})))
    peak_n = equalize_trajectory(plan).peaks.peak_n
    plan.out.unlink()
    done = equalize_trajectory(replace(plan, physics=tmp_path / "f.toml", cap_n=1.01 * peak_n))
    assert done.peaks.peak_n <= 1.01 * peak_n * (1 + 1e-9)
    assert 0 <= summarise_equalization(done)["compensated_share"] < 1
    assert any("of it fits under the cap" in line for line in format_equalization_lines(done))


def test_a_model_that_hides_its_amplitude_gets_no_friction_on_top(plants, plan, tmp_path):
    write_identified_model(tmp_path / "m.h5", model_of(plants.omega_like(0.1), provenance={}))
    write_mechanical_model(tmp_path / "f.toml", mechanism(ModelEffect("coulomb_friction", None, {"level": 0.1})))
    refused = refusal(replace(plan, models=(tmp_path / "m.h5",), physics=tmp_path / "f.toml"))
    assert refused.title == "Known physics cannot be compensated with this model"


def test_an_effect_on_an_axis_that_is_not_there_is_refused(plan, tmp_path):
    write_mechanical_model(tmp_path / "f.toml", mechanism(ModelEffect("coulomb_friction", "q", {"level": 0.1})))
    refused = refusal(replace(plan, physics=tmp_path / "f.toml"))
    assert refused.title == "The known physics does not fit the model"
    assert "on the axis 'q'" in refused.happened
