"""A start that left two names: the sealed device plays what was proposed, and the right name is left.

The start's answer is written by hand: whether a diagnosis leaves several names is not what is tested here.
"""

import json

import pytest

from analysis.diagnosis.next_experiment.experiment_menu import list_experiments
from analysis.evaluation.blind_test.follow_up import FollowUp, compute_follow_up_figures
from equalizer.plant.effect_vocabulary import EFFECT_ENTRIES
from study.errors import StudyError
from study.evaluation.bank.follow_up import FOLLOW_UP_FOLDER, PROPOSED_KEY, RANDOM_KEY, follow_up
from study.evaluation.bank.proof_folder import (
    ANSWER_FILE,
    FURTHER_RECORDING_FILE,
    MODEL_FILE,
    RECORDING_FILE,
    SETTINGS_FILE,
    WORKER_DIED_KEY,
    ProofFolder,
    open_proof_folder,
)
from study.evaluation.bank.prove import make_outcome
from study.evaluation.bank.seal_cases import BankPlan, format_settings, write_sealed_case
from study.evaluation.challenge.draw_bank import draw_case_plan
from study.store.disk.provenance import compute_sha256
from study.store.formats.mechanical_model_file import read_mechanical_model

SEED, NUMBER, LEVEL_N = 51_404, 0, 3.0
"""A gain of the accelerometer."""
PLAN = BankPlan(SEED, 1, brief=True)
CONSIDERED = ("sensor_gain", "force_gain", "sensor_lag", "coulomb_friction", "added_mass")
"""Of the catalogue, for the time that it takes."""
ERRORS = {"before": 9.0, "retuned": 9.0, "after": 1.0, "noise": 1.0}


def answer(place, effect="sensor_gain", rival="force_gain", best=""):
    """As the process of the diagnosis writes it."""
    named = {
        "effect": effect, "place": "sensor", "axis": None, "probability": 0.5, "share": 0.9,
        "parameters": {"gain": {"value": 1.02, "unit": "1", "ci95": [1.01, 1.03]}},
        "rivals": [{"effect": rival, "probability": 0.5, "inseparable": True, "why_not": "as good"}],
    }  # fmt: skip
    diagnosis = {
        "verdict": "explained", "mismatch": [], "effects": [named], "retuned": {}, "remainder": [],
        "fit": {"fit": ERRORS, "test": ERRORS}, "error": "free simulation", "next_experiment": None,
    }  # fmt: skip
    said = {
        "diagnosis": diagnosis,
        "channel_errors": {"retuned": {"ay": 9.0}},
        "proposal": {"axis": 0, "level": LEVEL_N, "best": [best] if best else []},
        "recording_sha256": compute_sha256(place / RECORDING_FILE),
        "model_sha256": compute_sha256(place / MODEL_FILE),
    }
    (place / ANSWER_FILE).write_text(json.dumps(said))


def started(path, best):
    folder = open_proof_folder(path, SEED, True)
    write_sealed_case(folder, draw_case_plan(SEED, NUMBER, True))
    label = json.loads(folder.get_label_file(NUMBER).read_text())
    place = folder.open / label["name"]
    without = [effect.name for effect in EFFECT_ENTRIES if effect.name not in CONSIDERED]
    (place / SETTINGS_FILE).write_text(format_settings(without))
    menu = list_experiments(read_mechanical_model(place / MODEL_FILE), 1000.0, 0, LEVEL_N)
    answer(place, best=menu[0].words if best else "")
    outcome = make_outcome(label, json.loads((place / ANSWER_FILE).read_text()))
    (place / RECORDING_FILE).unlink()  # as a bank leaves it
    return folder, outcome, menu


@pytest.fixture(scope="module")
def followed(tmp_path_factory):
    folder, outcome, menu = started(tmp_path_factory.mktemp("bank") / "proof", True)
    seen = []
    found = follow_up(folder, PLAN, (outcome,), (2, False), lambda done, of: seen.append((done, of)))
    return folder, outcome, menu, found, seen


@pytest.mark.slow
def test_the_right_name_is_left_by_the_recording_that_was_proposed(followed):
    _, outcome, menu, (found,), seen = followed
    assert outcome.returned == ("sensor_gain", "force_gain")
    assert (found.proposed, found.after_proposed, found.resolved) == (menu[0].words, ("sensor_gain",), True)
    assert found.drawn in [each.words for each in menu]
    assert found.after_drawn
    assert (seen[0], seen[-1]) == ((0, 2), (2, 2))


@pytest.mark.slow
def test_both_cases_are_told_nothing_of_which_is_which(followed):
    folder, *_ = followed
    again = ProofFolder(folder.path / FOLLOW_UP_FOLDER)
    label = json.loads(again.get_label_file(NUMBER).read_text())
    assert {path.name for path in again.open.iterdir()} == {
        label[which]["name"] for which in (PROPOSED_KEY, RANDOM_KEY)
    }
    for place in again.open.iterdir():
        assert {path.name for path in place.iterdir()} == {
            ANSWER_FILE,
            MODEL_FILE,
            "settings.json",
        }  # recordings are forgotten


@pytest.mark.slow
def test_the_same_call_continues_without_doing_anything_twice(followed):
    folder, outcome, _, found, _ = followed
    before = {path: path.stat().st_mtime_ns for path in (folder.path / FOLLOW_UP_FOLDER).rglob("*") if path.is_file()}
    assert follow_up(folder, PLAN, (outcome,), (2, False), lambda done, of: None) == found
    assert {
        path: path.stat().st_mtime_ns for path in (folder.path / FOLLOW_UP_FOLDER).rglob("*") if path.is_file()
    } == before


@pytest.mark.slow
def test_where_nothing_is_proposed_the_start_stays_open_and_the_random_one_is_played(tmp_path, monkeypatch):
    folder, outcome, _ = started(tmp_path / "bank", False)
    asked = []
    monkeypatch.setattr("study.evaluation.bank.ask_engine.diagnose_cases", lambda again, names, *_: asked.extend(names))
    with pytest.raises(StudyError, match="answer.json"):  # without an answer
        follow_up(folder, PLAN, (outcome,), (1, False), lambda done, of: None)
    (name,) = asked
    assert (folder.path / FOLLOW_UP_FOLDER / "open" / name / FURTHER_RECORDING_FILE.format(2)).exists()


@pytest.mark.slow
def test_a_case_whose_process_died_keeps_all_its_recordings(tmp_path, monkeypatch):
    """It is asked again by the next run, with what was sealed."""

    def die(again, names, _, on_answered):
        for name in names:
            (again.open / name / ANSWER_FILE).write_text(
                json.dumps({"name": name, "failed": "it died", WORKER_DIED_KEY: True})
            )
            on_answered(name)

    folder, outcome, _ = started(tmp_path / "bank", False)
    monkeypatch.setattr("study.evaluation.bank.ask_engine.diagnose_cases", die)
    follow_up(folder, PLAN, (outcome,), (1, False), lambda done, of: None)
    (place,) = (folder.path / FOLLOW_UP_FOLDER / "open").iterdir()
    assert {path.name for path in place.glob("*.h5")} == {RECORDING_FILE, FURTHER_RECORDING_FILE.format(2)}


def test_what_an_earlier_answer_proposed_is_not_counted(tmp_path, monkeypatch):
    """The start is diagnosed again, by another version, and proposes something else."""
    monkeypatch.setattr("study.evaluation.bank.ask_engine.diagnose_cases", lambda *_: None)
    folder, outcome, menu = started(tmp_path / "bank", True)
    with pytest.raises(StudyError, match="answer.json"):  # without an answer
        follow_up(folder, PLAN, (outcome,), (1, False), lambda done, of: None)
    path = next(folder.open.glob(f"*/{ANSWER_FILE}"))
    said = json.loads(path.read_text())
    path.write_text(json.dumps(said | {"proposal": said["proposal"] | {"best": [menu[1].words]}}))
    with pytest.raises(StudyError, match="belongs to an earlier answer") as refused:
        follow_up(folder, PLAN, (outcome,), (1, False), lambda done, of: None)
    assert f"Delete the folder {folder.path / FOLLOW_UP_FOLDER}" in refused.value.do_now
    sealed = ProofFolder(folder.path / FOLLOW_UP_FOLDER).get_label_file(NUMBER)
    sealed.write_text(sealed.read_text().replace('"proposal"', '"proposal" '))
    with pytest.raises(StudyError, match="A seal is broken"):  # and is not hidden by the other refusal
        follow_up(folder, PLAN, (outcome,), (1, False), lambda done, of: None)


def test_a_start_with_one_name_is_not_taken_up_again(tmp_path):
    folder, _, _ = started(tmp_path / "bank", True)
    place = folder.open / json.loads(folder.get_label_file(NUMBER).read_text())["name"]
    said = json.loads((place / ANSWER_FILE).read_text())
    said["diagnosis"]["effects"][0]["rivals"] = []
    alone = make_outcome(json.loads(folder.get_label_file(NUMBER).read_text()), said)
    assert follow_up(folder, PLAN, (alone,), (1, False), lambda done, of: None) == ()


def test_a_device_that_cannot_be_drawn_again_is_reported(tmp_path):
    folder, outcome, _ = started(tmp_path / "bank", True)
    path = folder.get_label_file(NUMBER)
    path.write_text(json.dumps(json.loads(path.read_text()) | {"recording_sha256": "0" * 64}))
    with pytest.raises(StudyError, match="cannot be drawn again"):
        follow_up(folder, PLAN, (outcome,), (1, False), lambda done, of: None)


def test_shares_count_all_starts_and_those_for_which_something_is_proposed():
    both = ("sensor_lag", "logger_offset")
    found = [
        FollowUp(1, "sensor_lag", both, "a sweep", ("sensor_lag",), "another", both),
        FollowUp(2, "sensor_lag", both, "a sweep", both, "a sweep", both),
        FollowUp(3, "logger_offset", both, "a sweep", ("sensor_lag",), "another", ("logger_offset",)),
        FollowUp(4, "extra_mode", ("extra_mode", "body_on_actuator"), "", (), "another", ("extra_mode",)),
    ]
    assert [(follow_up_figure.hits, follow_up_figure.of) for follow_up_figure in compute_follow_up_figures(found)] == [
        (1, 4),
        (2, 4),
        (1, 3),
        (1, 3),
    ]
