"""A small rehearsal: several at once, interrupted, gone on with."""

from concurrent.futures import Executor
from dataclasses import replace

import numpy as np
import pytest

from equalizer.plant.identified_model import IdentifiedModel
from protocols.document.loading import load_protocol
from study.errors import StudyError, UserInterruptError
from study.store.formats.identified_model_file import read_identified_model, write_identified_model
from study.store.sessions.archive import list_session_folders
from study.store.sessions.event_log import read_log
from study.workflows.results.collect_sessions import collect_sessions
from study.workflows.results.fold_session import fold_session
from study.workflows.session.rehearse_study import Rehearsal, derive_subject_seed, rehearse_study


@pytest.fixture
def rehearsal(sitter) -> Rehearsal:
    return Rehearsal(sitter.protocol, sitter.text, subjects=3, seed=5, data=sitter.data)


def decisions(folder):
    return [(t.run, t.trial, t.level_n, t.correct) for t in fold_session(folder).state.trials if t.is_valid]


@pytest.mark.slow
@pytest.mark.timeout(200)
def test_a_rehearsal_that_was_cut_off_continues_and_ends_the_same(rehearsal, sitter, session_logs):
    done = []
    rehearse_study(rehearsal, workers=2, on_finished=done.append)
    assert done == [1, 2, 3]
    folders = list_session_folders(sitter.data)
    assert [f.name for f in folders] == ["S001_001", "S002_001", "S003_001"]
    whole = [decisions(f) for f in folders]
    assert len({str(d) for d in whole}) == 3
    # As a kill leaves it: the second participant is half way, with a torn line.
    log = folders[1].log.read_bytes()
    folders[1].log.write_bytes(log[: len(log) // 2])
    session_logs.unsealed(folders[1].path)
    untouched = folders[0].log.read_bytes()
    rehearse_study(rehearsal, workers=1, on_finished=done.append)
    assert done == [1, 2, 3, 1, 2, 3]
    assert folders[0].log.read_bytes() == untouched
    assert [len(d) for d in map(decisions, folders)] == [len(d) for d in whole]
    assert decisions(folders[0]) == whole[0]
    kinds = [event.event for event in read_log(folders[1].log).events]
    assert "session_resumed" in kinds
    other = Rehearsal(sitter.protocol, sitter.text, subjects=3, seed=6, data=sitter.data)
    with pytest.raises(StudyError, match="holds another rehearsal"):
        rehearse_study(other, workers=1, on_finished=done.append)


class Interrupted(Executor):
    """Ctrl-C, as the first session is handed to a worker."""

    def submit(self, function, /, *arguments, **named):
        raise KeyboardInterrupt


def test_an_interruption_promises_only_what_workers_elsewhere_have_finished(rehearsal):
    with pytest.raises(UserInterruptError) as left:
        rehearse_study(rehearsal, Interrupted(), lambda done: None)
    assert left.value.saved == f"All sessions finished so far are in {rehearsal.data}."


def test_neighbouring_rehearsals_share_no_participant():
    seeds = {derive_subject_seed(seed, number) for seed in range(20) for number in range(20)}
    assert len(seeds) == 400


@pytest.fixture
def equalized(small_text, tmp_path) -> Rehearsal:
    axes = (("fx", "fy", "fz"), ("ax", "ay", "az"))
    zero = np.zeros((3, 3))
    model = IdentifiedModel(zero, 2 * np.eye(3), np.eye(3), zero, 1000.0, (4.0, 50.0), "N", "m/s^2", *axes)
    write_identified_model(tmp_path / "model.h5", model)
    text = small_text.replace("[stimulus]\n", '[stimulus]\nquantity = "delivered_acceleration"\n')
    return Rehearsal(load_protocol(text, "small.toml"), text, 1, 5, tmp_path / "r", tmp_path / "model.h5")


@pytest.mark.slow
@pytest.mark.parametrize("locked", [False, True])
def test_a_rehearsal_says_whether_its_protocol_was_locked(sitter, locked):
    rehearsal = Rehearsal(sitter.protocol, sitter.text, subjects=1, seed=5, data=sitter.data, locked=locked)
    rehearse_study(rehearsal, workers=1, on_finished=lambda _: None)
    assert collect_sessions(sitter.data).lock_statement.startswith("yes" if locked else "no")


@pytest.mark.slow
def test_a_rehearsal_does_not_continue_with_another_model(tmp_path, equalized):
    equalized = replace(equalized, subjects=1)
    rehearse_study(equalized, workers=1, on_finished=lambda done: None)
    rehearse_study(equalized, workers=1, on_finished=lambda done: None)
    other = tmp_path / "other.h5"
    model = read_identified_model(equalized.model)
    write_identified_model(other, replace(model, C=2 * model.C))
    with pytest.raises(StudyError, match="begun with another --model"):
        rehearse_study(replace(equalized, model=other), workers=1, on_finished=lambda done: None)
