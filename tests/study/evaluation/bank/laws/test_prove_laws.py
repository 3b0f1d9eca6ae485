"""A bank of laws from start to end: sealed with a fresh motion, answered apart with the search for laws, revealed."""

import json
import shutil

import pytest

from analysis.evaluation.laws.law_score import compute_law_score
from study.errors import StudyError
from study.evaluation.bank.laws import prove_laws as prove_laws_module
from study.evaluation.bank.laws.prove_laws import LawBlindTest, prove_laws, reveal_laws
from study.evaluation.bank.laws.seal_laws import get_fresh_motions_path, read_fresh_motions, seal_laws
from study.evaluation.bank.laws.write_law_proof import format_law_lines, summarise_law_blind_test, write_law_proof
from study.evaluation.bank.proof_folder import (
    ANSWER_FILE,
    RECORDING_FILE,
    SETTINGS_FILE,
    WORKER_DIED_KEY,
    ProofFolder,
    open_proof_folder,
)
from study.evaluation.bank.proof_seals import read_label
from study.evaluation.bank.seal_cases import BankPlan
from study.evaluation.bank.sealed_bank import BankOptions
from study.store.disk.provenance import compute_sha256

SEED = 30_313
"""Its first device has a law."""


@pytest.fixture(scope="module")
def sealed(tmp_path_factory):
    folder = open_proof_folder(tmp_path_factory.mktemp("laws") / "bank", SEED, True, "laws")
    seal_laws(folder, BankPlan(SEED, 1, brief=True), 1, lambda done: None)
    return folder


@pytest.mark.slow
def test_the_diagnosis_is_told_to_look_for_laws_and_not_for_which(sealed):
    place = next(sealed.open.iterdir())
    asked = json.loads((place / SETTINGS_FILE).read_text())
    assert asked["discovery"]
    assert asked["without"] == []
    assert sorted(each.name for each in place.iterdir()) == ["model.toml", "recording.h5", "settings.json"]


@pytest.mark.slow
def test_fresh_motion_lies_with_the_label(sealed):
    label = read_label(sealed.get_label_file(0))
    truth = label["truth"]
    found = read_fresh_motions(
        get_fresh_motions_path(sealed, 0), label["axes"], truth["axes"], truth["acts_on"] == ["response"]
    )
    assert len(found) == 2
    assert set(truth["axes"]) == set(found[0].contributions)
    assert len(found[0].signals["t"]) == len(found[0].contributions[truth["axes"][0]])


@pytest.mark.slow
def test_another_fresh_motion_breaks_the_seal(sealed, tmp_path):
    copy = open_proof_folder(tmp_path / "copy", SEED, True, "laws")
    for name in ("labels.sha256", "sealed/00000.json"):
        (copy.path / name).write_bytes((sealed.path / name).read_bytes())
    get_fresh_motions_path(copy, 0).write_bytes(b"other")
    with pytest.raises(StudyError, match="seal"):
        reveal_laws(copy, 1)


@pytest.mark.slow
def test_a_case_without_answer_and_recording_is_drawn_again_and_not_left_out(sealed, tmp_path, monkeypatch):
    copy = tmp_path / "copy"
    shutil.copytree(sealed.path, copy)
    (place,) = (copy / "open").iterdir()
    (place / RECORDING_FILE).unlink()
    asked = []
    monkeypatch.setattr(prove_laws_module, "diagnose_and_count", lambda folder, names, *_, keep: asked.extend(names))
    prove_laws(copy, BankPlan(SEED, 1, brief=True), BankOptions(), lambda what, done, of: None)
    assert asked == [place.name]
    assert compute_sha256(place / RECORDING_FILE) == read_label(sealed.get_label_file(0))["recording_sha256"]


def test_the_commit_is_that_of_the_code_that_answered(tmp_path):
    done = LawBlindTest(ProofFolder(tmp_path), BankPlan(SEED, 1), "", (), compute_law_score(()), ("another",))
    write_law_proof(done)
    assert json.loads((tmp_path / "proof.json").read_text())["commit"] == "unknown: the code has changed since"


@pytest.mark.slow
def test_a_case_whose_process_was_killed_is_said_and_how_to_go_on(sealed, tmp_path, monkeypatch):
    def die(folder, names, *_, keep):
        for name in names:
            (folder.open / name / ANSWER_FILE).write_text(json.dumps({"failed": "it died", WORKER_DIED_KEY: True}))

    shutil.copytree(sealed.path, tmp_path / "copy")
    monkeypatch.setattr(prove_laws_module, "diagnose_and_count", die)
    done = prove_laws(tmp_path / "copy", BankPlan(SEED, 1, brief=True), BankOptions(), lambda what, done, of: None)
    assert any("1 case has no answer" in line and "same command again" in line for line in format_law_lines(done))
    assert summarise_law_blind_test(done)["unanswered"] == 1


@pytest.mark.slow
def test_a_folder_of_effects_is_no_folder_of_laws(sealed):
    with pytest.raises(StudyError, match="another bank"):
        open_proof_folder(sealed.path, SEED, True)


@pytest.mark.slow
def test_no_law_is_named_that_is_not_there(tmp_path):
    done = prove_laws(tmp_path / "bank", BankPlan(SEED, 20, brief=True), BankOptions(), lambda what, done, of: None)
    write_law_proof(done)
    assert json.loads((done.folder.path / "proof.json").read_text())["of"] == "laws"
    assert next(format_law_lines(done)).endswith("misses in 20 cases")
    assert [each.number for each in done.outcomes if each.diagnosis is None] == []
    assert [each.number for each in done.outcomes if each.false_law or each.wrongly_explained] == []
