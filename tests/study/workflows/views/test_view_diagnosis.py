"""A diagnosis in words: the verdict, each effect with its interval, and numbers in tables."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from analysis.diagnosis.document import (
    Diagnosis,
    Errors,
    Estimate,
    Fit,
    Mismatch,
    NamedEffect,
    NextExperiment,
    Rival,
)
from study.errors import StudyError
from study.store.formats.diagnosis_file import write_diagnosis
from study.workflows.views.view_diagnosis import make_diagnosis_view

PLACE = Mismatch("ax", "fx", (5.0, 15.0), 1.5, "near v = 0", 0.8, 1e-9)
FRICTION = NamedEffect(
    "coulomb_friction", "mechanism", "x", 0.9, 0.97,
    {"level": Estimate(0.21, "N", (0.2, 0.22))},
    (Rival("stribeck_friction", 0.03, True, "Its static level is that of sliding."),
     Rival("hardening_stiffness", 0.001, False, "No level bends it.")),
)  # fmt: skip
ERRORS = Errors(0.3, 0.28, 0.05, None)
FOUND = Diagnosis(
    "partly_explained", (PLACE,), (FRICTION,), {"mass": 0.2}, (replace(PLACE, amplitude=None, state=None),),
    Fit(ERRORS, ERRORS), "free simulation",
    NextExperiment("hapteq record slow --out N.h5", ("coulomb_friction", "stribeck_friction"), "Slow."),
)  # fmt: skip


@pytest.fixture
def view(tmp_path):
    write_diagnosis(tmp_path / "diagnosis.json", FOUND)
    return make_diagnosis_view(tmp_path / "diagnosis.json")


def test_each_effect_is_a_sentence_with_its_interval(view):
    assert view.verdict.startswith("Missing in the model: dry friction on the x drive, but that is not all.")
    assert view.sentences[0].startswith("Dry friction on the x drive, 0.21")
    assert view.sentences[0].endswith(
        "It explains 90 % of the mismatch that remains after re-tuning (probability 0.97)."
    )


def test_a_rival_says_why_not_and_what_cannot_be_told_apart_stands_beside_the_name(view):
    assert view.rivals == ("A spring that hardens with displacement (probability < 0.01): No level bends it.",)
    assert view.sentences[1].startswith(
        "These data do not distinguish dry friction from friction that is larger at rest"
    )


def test_tables_have_a_header_and_a_row_each(view):
    assert view.mismatch[1] == ("ax", "fx", "5 to 15 Hz", "1.5", "near v = 0", "80 %", "< 0.0001")
    assert view.remainder[1][3:5] == ("all", "")
    assert view.fit[1] == ("fit", "0.3000", "0.2800", "0.0500", "–")


def test_a_p_value_of_zero_is_shown_as_an_upper_bound(tmp_path):
    sure = replace(FOUND, mismatch=(replace(PLACE, p_value=0.0), replace(PLACE, p_value=0.02)))
    write_diagnosis(tmp_path / "diagnosis.json", sure)
    assert [row[-1] for row in make_diagnosis_view(tmp_path / "diagnosis.json").mismatch[1:]] == ["< 0.0001", "0.0200"]


def test_the_next_experiment_begins_with_its_command(view):
    assert view.next_experiment.splitlines()[0] == "hapteq record slow --out N.h5"
    assert view.next_experiment.endswith(
        "This distinguishes dry friction from friction that is larger at rest (Stribeck)."
    )
    assert "free simulation" in view.notes[0]
    assert view.notes[-1].startswith("Still unexplained: ax at 5 to 15 Hz")


def test_agreement_has_neither_effects_nor_mismatch(tmp_path):
    nothing = Diagnosis("no_mismatch", (), (), {}, (), Fit(ERRORS, ERRORS), "free simulation", None)
    write_diagnosis(tmp_path / "diagnosis.json", nothing)
    view = make_diagnosis_view(tmp_path / "diagnosis.json")
    assert (view.sentences, view.rivals, view.mismatch, view.remainder, view.next_experiment) == ((), (), (), (), "")


def test_the_report_beside_it_is_found(tmp_path):
    write_diagnosis(tmp_path / "diagnosis.json", FOUND)
    (tmp_path / "report.html").write_text("")
    assert make_diagnosis_view(tmp_path / "diagnosis.json").report == str(tmp_path / "report.html")


@pytest.mark.parametrize("content", ["", "[]", json.dumps({"format": "hapteq-diagnosis", "version": 1})])
def test_what_is_no_diagnosis_is_an_error_with_words(tmp_path, content):
    path = Path(tmp_path / "diagnosis.json")
    path.write_text(content)
    with pytest.raises(StudyError):
        make_diagnosis_view(path)
