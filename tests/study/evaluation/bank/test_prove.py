"""A bank from start to end on short recordings: sealed first, answered apart, revealed, and gone on with."""

import json
import math
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from study.errors import StudyError, UserInterruptError
from study.evaluation.bank import answer_cases
from study.evaluation.bank.proof_folder import (
    ANSWER_FILE,
    RECORDING_FILE,
    ProofFolder,
    hold_proof_folder,
    open_proof_folder,
)
from study.evaluation.bank.proof_seals import HASH_KEYS, seal
from study.evaluation.bank.proof_summary import format_blind_test, summarise_blind_test
from study.evaluation.bank.prove import make_outcome, prove
from study.evaluation.bank.seal_cases import BankPlan, list_drawable_cases
from study.evaluation.bank.sealed_bank import BankOptions, reveal_bank
from study.evaluation.bank.write_proof import read_current_commit, write_proof, write_table
from study.evaluation.challenge.draw_bank import draw_case_plan
from study.store.disk.file_errors import UnusableFileError

ROOT = Path(__file__).parents[4]
SEED = 51_401
PLAN = BankPlan(SEED, 1, brief=True)


@pytest.fixture(scope="module")
def proof(tmp_path_factory):
    seen = []
    path = tmp_path_factory.mktemp("bank") / "proof"
    return prove(path, PLAN, BankOptions(), lambda what, done, of: seen.append((what, done, of))), seen


def test_a_bank_is_sealed_answered_and_revealed(proof):
    done, seen = proof
    assert len(done.outcomes) == len(list_drawable_cases(PLAN))
    assert seen[-1] == ("diagnosing", len(done.outcomes), len(done.outcomes))
    assert [outcome.verdict for outcome in done.outcomes if outcome.verdict == "failed"] == []
    assert len(done.engines) == 1


def test_a_case_without_an_answer_is_said_and_how_to_go_on(proof):
    done, _ = proof
    assert summarise_blind_test(done)["unanswered"] == 0 and not any(
        "no answer" in line for line in format_blind_test(done)
    )
    lost = replace(done.outcomes[0], diagnosis=None, seconds=math.nan)
    missing = replace(done, outcomes=(lost, *done.outcomes[1:]))
    assert summarise_blind_test(missing)["unanswered"] == 1
    assert any("1 case has no answer" in line and "same command again" in line for line in format_blind_test(missing))


def test_seals_are_read_by_sha256sum_and_come_before_any_answer(proof):
    folder = proof[0].folder
    checked = subprocess.run(["sha256sum", "--check", "--status", "labels.sha256"], cwd=folder.path, check=False)
    assert checked.returncode == 0
    answers = [path.stat().st_mtime_ns for path in folder.open.glob(f"*/{ANSWER_FILE}")]
    assert folder.seals_file.stat().st_mtime_ns <= min(answers)


def test_what_the_diagnosis_is_given_tells_neither_number_nor_seed(proof):
    folder = proof[0].folder
    for place in folder.open.iterdir():
        given = (place / "model.toml").read_text() + (place / "settings.json").read_text()
        assert str(SEED)[:4] not in given
        assert not (place / RECORDING_FILE).exists()  # megabytes that have been answered


def test_the_process_that_answers_never_loads_the_challenge(proof):
    folder = proof[0].folder
    answers = [json.loads(path.read_text()) for path in folder.open.glob(f"*/{ANSWER_FILE}")]
    assert [answer["knows_the_challenge"] for answer in answers] == [False] * len(answers)


def test_a_loaded_challenge_is_noticed(monkeypatch):
    for name in [name for name in sys.modules if name.startswith(answer_cases.CHALLENGE_PACKAGE)]:
        monkeypatch.setitem(sys.modules, name, None)
    assert not answer_cases.is_challenge_loaded()
    monkeypatch.setitem(sys.modules, f"{answer_cases.CHALLENGE_PACKAGE}.draw_case", sys)
    assert answer_cases.is_challenge_loaded()


@pytest.mark.parametrize(
    ("does", "refused"),
    [
        ("import study.evaluation.challenge.draw_case", "ModuleNotFoundError"),
        ("(cases.parent / 'sealed' / '00000.json').read_text()", "PermissionError"),
        ("open(f'{cases}/../sealed/00000.json')", "PermissionError"),
        ("open(f'{cases}/../sealed/00000.json'.encode())", "PermissionError"),
        ("import os; os.listdir(cases.parent / 'sealed')", "PermissionError"),
        ("import os; list(os.scandir(cases.parent))", "PermissionError"),
        ("import os; os.chdir(cases.parent)", "PermissionError"),
        ("import subprocess; subprocess.run(['cat', f'{cases}/../sealed/00000.json'])", "PermissionError"),
        (
            "import study; (Path(study.__path__[0]) / 'evaluation' / 'challenge' / 'draw_bank.py').read_text()",
            "PermissionError",
        ),
    ],
)
def test_the_process_that_answers_reaches_no_label(proof, does, refused):
    script = (
        "from pathlib import Path\nfrom study.evaluation.bank.answer_cases import isolate_process\n"
        f"cases = Path({str(proof[0].folder.open)!r})\nisolate_process(cases)\n{does}"
    )
    done = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=False)
    assert refused in done.stderr


@pytest.mark.parametrize("opened", ["next/open", "controls/1/open", "linked"])
def test_follow_ups_controls_and_cases_behind_a_link_reach_no_label_either(copied, tmp_path, opened):
    cases = copied.path / opened
    if opened == "linked":
        (tmp_path / "elsewhere").mkdir()
        cases.symlink_to(tmp_path / "elsewhere")
    else:
        cases.mkdir(parents=True)
    script = (
        "import sys\nfrom pathlib import Path\nfrom study.evaluation.bank import answer_cases\n"
        f"sys.stdin = ['']\nanswer_cases.answer_case = lambda *_: Path({str(copied.get_label_file(0))!r}).read_text()\n"
        f"answer_cases.main([{str(cases)!r}])"
    )
    done = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=False)
    assert "PermissionError: a diagnosis must not open" in done.stderr


def test_the_same_command_continues_without_doing_anything_twice(proof):
    folder, seen = proof[0].folder, []
    before = {path: path.stat().st_mtime_ns for path in folder.open.glob(f"*/{ANSWER_FILE}")}
    again = prove(folder.path, PLAN, BankOptions(), lambda what, done, of: seen.append((what, done, of)))
    assert {path: path.stat().st_mtime_ns for path in folder.open.glob(f"*/{ANSWER_FILE}")} == before
    assert again.seal == proof[0].seal
    assert [outcome.number for outcome in again.outcomes] == [outcome.number for outcome in proof[0].outcomes]


def test_a_proof_leaves_a_document_a_row_per_case_and_a_small_table(proof, tmp_path):
    done = proof[0]
    write_proof(done)
    write_table(tmp_path / "small.csv", done)
    assert len((done.folder.path / "proof.csv").read_text().splitlines()) == len(done.outcomes) + 1
    assert json.loads((done.folder.path / "proof.json").read_text())["format"] == "hapteq-proof"
    assert f"# seal of the labels {done.seal}" in (tmp_path / "small.csv").read_text()
    misses = (tmp_path / "small-misses.csv").read_text().splitlines()
    assert len(misses) == 1 + len(done.score.misses)
    document = json.loads((done.folder.path / "proof.json").read_text())
    write_proof(replace(done, engines=("another",)))
    assert json.loads((done.folder.path / "proof.json").read_text())["commit"] == "unknown: the code has changed since"
    assert document["commit"] == read_current_commit()
    assert next(format_blind_test(done)).endswith(f"misses in {len(done.outcomes)} cases")
    assert summarise_blind_test(done)["cases"] == len(done.outcomes)


@pytest.fixture
def copied(proof, tmp_path):
    folder = ProofFolder(tmp_path / "copy")
    subprocess.run(["cp", "-r", str(proof[0].folder.path), str(folder.path)], check=True)
    return folder


def test_a_second_process_on_the_same_bank_is_refused_and_changes_nothing(copied):
    """It once removed the cases that the first was writing, and replaced its answers by failures."""
    begun = copied.unfinished / "a1b2"
    begun.mkdir(parents=True)
    with hold_proof_folder(copied), pytest.raises(StudyError, match="Another process works on this bank"):
        prove(copied.path, PLAN, BankOptions(), lambda *_: None)
    assert begun.exists()
    prove(copied.path, PLAN, BankOptions(), lambda *_: None)
    assert not begun.exists()


def test_a_lock_that_cannot_be_written_is_told_with_its_reason(tmp_path):
    (tmp_path / "bank.lock").mkdir()
    with (
        pytest.raises(StudyError, match="cannot be written to.*Is a directory"),
        hold_proof_folder(ProofFolder(tmp_path)),
    ):
        pass


def test_a_label_that_was_changed_afterwards_breaks_its_seal(copied):
    path = next(copied.sealed.glob("*.json"))
    path.write_text(path.read_text().replace('"kind"', '"kind" '))
    with pytest.raises(StudyError, match="A seal is broken"):
        reveal_bank(copied, 100, make_outcome)
    sealed = copied.seals_file.read_text()
    with pytest.raises(StudyError, match="A seal is broken"):
        prove(copied.path, PLAN, BankOptions(), lambda *_: None)
    assert copied.seals_file.read_text() == sealed


def test_a_label_that_was_removed_afterwards_breaks_its_seal(tmp_path):
    folder = ProofFolder(tmp_path)
    folder.sealed.mkdir()
    for number in range(2):
        folder.get_label_file(number).write_text(f'{{"name": "a1b2", "number": {number}}}')
    seal(folder)
    assert reveal_bank(folder, 100, make_outcome) == ()
    folder.get_label_file(1).unlink()
    with pytest.raises(StudyError, match=r"A seal is broken.*00001\.json"):
        reveal_bank(folder, 100, make_outcome)


def test_a_copy_of_a_label_is_not_counted_twice(copied):
    """A copy with a blank in its name once made the list of seals unreadable for ever."""
    (copied.sealed / "00000 (copy).json").write_bytes(copied.get_label_file(0).read_bytes())
    assert len(prove(copied.path, PLAN, BankOptions(), lambda *_: None).outcomes) == 1
    copied.get_label_file(7).write_bytes(copied.get_label_file(0).read_bytes())
    with pytest.raises(StudyError, match=r"A seal is broken.*00007\.json"):
        prove(copied.path, PLAN, BankOptions(), lambda *_: None)


def test_a_sealed_case_that_cannot_be_drawn_here_is_scored_and_not_said_to_be_left_out(copied, monkeypatch):
    """As of MuJoCo, with which the bank was sealed on another machine."""
    for module in ("prove", "seal_cases"):
        monkeypatch.setattr(f"study.evaluation.bank.{module}.list_drawable_cases", lambda plan: ())
    no_longer_counted = copied.path / "next" / "open" / "a1b2"
    no_longer_counted.mkdir(parents=True)
    (no_longer_counted / ANSWER_FILE).write_text('{"engine": "old"}')
    done = prove(copied.path, PLAN, BankOptions(), lambda *_: None)
    assert (len(done.outcomes), done.omitted_cases, len(done.engines), done.other_engines) == (1, 0, 1, ())


def test_seals_that_are_none_break_the_proof(copied):
    copied.seals_file.write_text("garbage\n")
    with pytest.raises(StudyError, match="A seal is broken"):
        prove(copied.path, PLAN, BankOptions(), lambda *_: None)


@pytest.mark.parametrize("without", [*HASH_KEYS, "knows_the_challenge"])
def test_an_answer_that_does_not_say_what_it_is_to_breaks_the_seal(copied, without):
    path = next(copied.open.glob(f"*/{ANSWER_FILE}"))
    said = json.loads(path.read_text())
    path.write_text(json.dumps({key: value for key, value in said.items() if key != without}))
    with pytest.raises(StudyError, match="A seal is broken"):
        reveal_bank(copied, 100, make_outcome)


@pytest.mark.parametrize("torn", [ANSWER_FILE, "label"])
def test_a_torn_file_is_named(copied, torn):
    path = next(copied.open.glob(f"*/{ANSWER_FILE}")) if torn == ANSWER_FILE else next(copied.sealed.glob("*.json"))
    path.write_text(path.read_text()[:40])
    with pytest.raises(StudyError, match=path.name if torn == ANSWER_FILE else "A seal is broken"):
        prove(copied.path, PLAN, BankOptions(), lambda *_: None)


def test_an_answer_of_another_version_is_named_with_what_to_do(copied):
    path = next(copied.open.glob(f"*/{ANSWER_FILE}"))
    said = json.loads(path.read_text())
    path.write_text(json.dumps(said | {"diagnosis": said["diagnosis"] | {"of_a_later_version": 1}}))
    with pytest.raises(UnusableFileError, match="of_a_later_version") as told:
        prove(copied.path, PLAN, BankOptions(), lambda *_: None)
    assert told.value.do_now.startswith(f"Delete {path}")


def test_an_error_that_is_not_known_is_read(copied):
    path = next(copied.open.glob(f"*/{ANSWER_FILE}"))
    said = json.loads(path.read_text())
    path.write_text(json.dumps(said | {"channel_errors": {"retuned": {"ax": float("nan")}}}))
    assert "NaN" in path.read_text()
    assert len(reveal_bank(copied, 100, make_outcome)) == len(list_drawable_cases(PLAN))


@pytest.mark.slow
def test_an_answer_that_was_removed_is_given_again(copied):
    path = next(copied.open.glob(f"*/{ANSWER_FILE}"))
    before = json.loads(path.read_text())
    path.unlink()
    again = prove(copied.path, PLAN, BankOptions(workers=1), lambda *_: None)
    assert len(again.outcomes) == len(list_drawable_cases(PLAN))
    assert json.loads(path.read_text())["diagnosis"] == before["diagnosis"]


def test_a_folder_of_another_bank_is_refused(proof, tmp_path):
    with pytest.raises(StudyError, match="another bank"):
        open_proof_folder(proof[0].folder.path, SEED + 1, True)
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises(StudyError, match="a folder of its own"):
        open_proof_folder(tmp_path, SEED, True)


@pytest.mark.slow
def test_ctrl_c_keeps_what_is_sealed(tmp_path):
    def interrupt(what, done, of):
        if what == "diagnosing":
            raise KeyboardInterrupt

    with pytest.raises(UserInterruptError, match="Interrupted"):
        prove(tmp_path / "bank", PLAN, BankOptions(workers=1), interrupt)
    assert len(list((tmp_path / "bank" / "sealed").iterdir())) == len(list_drawable_cases(PLAN))


def test_the_short_bank_is_of_this_kind():
    assert {draw_case_plan(SEED, number, True).settings.period for number in range(3)} == {1000}
