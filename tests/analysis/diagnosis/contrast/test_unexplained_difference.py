"""A difference from the clean recordings that no fault explains is reported."""

import pytest

from analysis.diagnosis.diagnose import diagnose
from analysis.diagnosis.diagnosis_settings import DiagnosisSettings
from analysis.diagnosis.forces.rigid_model import fit_rigid_model
from analysis.diagnosis.localisation.model_error_floor import IncomparableRecordingsError
from analysis.diagnosis.reference import learn_model_error
from analysis.diagnosis.reference.compare_with_reference import Contrast, find_contrast
from analysis.diagnosis.result.contrast_findings import NOT_COMPARED, add_contrast
from analysis.diagnosis.search.time_budget import OUT_OF_TIME


@pytest.mark.slow
def test_a_fault_that_the_comparison_cannot_undo_is_left_open(rig):
    found = rig.make_contrast("coulomb_friction", 0.6, rig.UNDONE)
    assert found.is_unexplained
    assert not set(rig.UNDONE) & set(found.tested_effects)
    assert "added_mass" in found.tested_effects


def test_nothing_is_left_open_where_a_fault_is_named(rig):
    found = rig.make_contrast("coulomb_friction", 0.6)
    assert not found.is_unexplained
    assert found.comparison is not None and found.comparison.complete


@pytest.mark.slow
@pytest.mark.parametrize("seed", [2, 3])
def test_nothing_is_left_open_between_recordings_of_the_same_device(rig, seed):
    assert not rig.make_contrast(seed=seed).is_unexplained


def test_the_comparison_overrules_a_search_that_leaves_more_than_noise_and_has_not_its_fault(rig):
    found = rig.make_contrast("coulomb_friction", 0.6)
    assert found.contradicts(frozenset({"extra_mode", "constant_force"}), residual_is_noise=False)
    assert found.contradicts(frozenset(), residual_is_noise=False)
    assert not found.contradicts(frozenset({"extra_mode", "coulomb_friction"}), residual_is_noise=False)
    assert not found.contradicts(frozenset({"extra_mode"}), residual_is_noise=True)


@pytest.mark.slow
def test_where_nothing_sets_the_sets_apart_only_what_was_not_compared_is_named(rig):
    found = rig.make_contrast(seed=2)
    assert found.contradicts(frozenset({"coulomb_friction"}), residual_is_noise=True)
    assert not found.contradicts(frozenset({"pose_dependent_inertia"}), residual_is_noise=True)
    assert not found.contradicts(frozenset(), residual_is_noise=False)


@pytest.mark.slow
def test_clean_recordings_that_teach_a_model_nothing_leave_the_comparison_as_it_is(rig, monkeypatch):
    asked = []

    def teaches_nothing(*given):
        asked.append(given)
        raise IncomparableRecordingsError("they were measured otherwise")

    monkeypatch.setattr(learn_model_error, "learn_model_error", teaches_nothing)
    clean = rig.record_rig(1)
    settings = DiagnosisSettings(without=rig.UNDONE, clean=(clean,))
    faulty = rig.record_rig(2, "coulomb_friction", 0.6)
    found = diagnose([faulty], fit_rigid_model([clean], "given"), settings, map, lambda said, share: None)
    assert len(asked) == 2
    assert found.diagnosis.verdict == "unexplained"
    assert found.diagnosis.candidates
    assert not found.diagnosis.effects
    assert not {NOT_COMPARED, OUT_OF_TIME} & set(found.remarks)
    assert NOT_COMPARED in add_contrast(found, Contrast(None, None, None, None), faulty, 5.0).remarks
    part = find_contrast([faulty], [clean], frozenset(), lambda: False)
    assert OUT_OF_TIME in add_contrast(found, part, faulty, 5.0).remarks
