"""Recordings that were made with a known weight on the device, from their files on."""

from dataclasses import replace
from pathlib import Path

import pytest

from study.errors import StudyError
from study.store.formats.recording_file import read_recording, write_recording
from study.workflows.diagnosis.diagnosis_input import read_input
from study.workflows.diagnosis.fit_without_model import fit_linear_model


@pytest.fixture
def heavy(module_at, tmp_path):
    recording = module_at(Path(__file__).parents[3] / "diagnosed.py").recorded(1)
    write_recording(tmp_path / "heavy.h5", replace(recording, meta={"added_mass_kg": 0.03}))
    return tmp_path / "heavy.h5"


def test_the_weight_stays_in_the_file(heavy):
    assert read_recording(heavy).meta["added_mass_kg"] == 0.03


def test_no_model_is_fitted_to_a_device_with_a_weight_on(heavy):
    with pytest.raises(StudyError, match="a model that is fitted to it would include the weight") as refused:
        fit_linear_model(read_input([heavy], 1), lambda share: None)
    assert "Give a model of the device alone with --model" in str(refused.value)
