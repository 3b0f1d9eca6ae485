"""Controls are asked of processes apart, and their claims checked."""

import pytest

from study.evaluation.bank.ask_engine import is_answered
from study.evaluation.bank.proof_folder import ANSWER_FILE, WORKER_DIED_KEY
from study.evaluation.bank.run_controls import run_controls
from study.evaluation.challenge.controls import CONTROLS


@pytest.mark.slow
def test_noise_alone_and_a_clean_device_name_nothing_and_are_asked_once(tmp_path):
    quick = [control for control in CONTROLS if control.name in ("a silent recording", "strength zero")]
    seen = []
    first = run_controls(tmp_path, 51_502, 1, lambda done, of: seen.append((done, of)), quick)
    assert [(each.name, each.held) for each in first] == [(f"{each.name}, seed 51502", True) for each in quick]
    assert seen == [(0, 2), (1, 2), (2, 2)]
    again = run_controls(tmp_path, 51_502, 1, lambda done, of: seen.append((done, of)), quick)
    assert again == first and seen[-1] == (2, 2)


def test_a_case_whose_process_died_is_asked_again(tmp_path):
    (tmp_path / ANSWER_FILE).write_text('{"failed": "killed", "' + WORKER_DIED_KEY + '": true}')
    assert not is_answered(tmp_path)
    (tmp_path / ANSWER_FILE).write_text('{"failed": "an error of ours"}')
    assert is_answered(tmp_path)


@pytest.mark.slow
@pytest.mark.timeout(0)
def test_every_control_holds(tmp_path):
    found = run_controls(tmp_path, 51_502, 2, lambda done, of: None)
    assert [each for each in found if not each.held] == []
