"""A case's three files, in the format of the labelled ones."""

import json
from dataclasses import replace

import numpy as np
import pytest

from study.evaluation.bank.seal_cases import truth_text, write_case
from study.evaluation.challenge.draw_case import Truth, draw_case
from study.store.formats.mechanical_model_file import read_mechanical_model
from study.store.formats.recording_file import read_recording


@pytest.fixture(scope="module")
def case():
    return draw_case(11, ["force_gain"], strength=0.5, name="bench case-11")


def test_files_hold_the_case(case, tmp_path):
    write_case(tmp_path, "case-11", case)
    recording = read_recording(tmp_path / "case-11.h5")
    model = read_mechanical_model(tmp_path / "case-11.toml")
    (truth,) = json.loads((tmp_path / "case-11.truth.json").read_text(encoding="utf-8"))
    np.testing.assert_allclose(recording.response.samples, case.recording.response.samples, atol=1e-5)
    assert recording.segments == case.recording.segments
    assert model.name == "bench case-11"
    np.testing.assert_array_equal(model.stiffness, case.model.stiffness)
    assert (truth["effect"], truth["place"]) == ("force_gain", "actuator")
    assert set(truth["values"]) == {"gain"}


def test_nothing_missing_is_an_empty_list(case):
    assert json.loads(truth_text(replace(case, truth=()))) == []


def test_what_the_vocabulary_has_no_name_for_stands_apart(case):
    truth = Truth("end_stop", "mechanism", "x", {"position": 0.01}, {"sides": 1.0})
    (entry,) = json.loads(truth_text(replace(case, truth=(truth,))))
    assert entry["unseen"] == {"sides": 1.0}
