"""Sessions of simulated participants who feel what is delivered, or ask again when unsure."""

import numpy as np
import pytest

from analysis.psychophysics.repeated_trials import format_repeat_warning
from protocols.trial import Phase, VoidCause
from study.devices.clock import VirtualClock
from study.errors import StudyError
from study.participants.delivered_feeler import DeliveredFeeler
from study.store.sessions.archive import list_session_folders
from study.workflows.results.fold_session import fold_session
from study.workflows.session.conduct_session import conduct_new
from study.workflows.session.rehearse_study import Rehearsal, rehearse_study
from study.workflows.session.simulated_participant import make_simulated_participant
from tests.slow_instances import slow


def conducted(sitter, observer, seed=11):
    sitter.seed = seed
    participant = make_simulated_participant(observer, seed, VirtualClock())
    return conduct_new(sitter.plan(f"{observer[:4].upper()}{seed}", observer), "simulated", participant)


@pytest.mark.slow
def test_what_is_felt_is_what_the_session_measures(sitter, monkeypatch):
    felt = []
    reply = DeliveredFeeler.reply
    monkeypatch.setattr(DeliveredFeeler, "reply", lambda self, each, seed: felt.append(each) or reply(self, each, seed))
    done = conducted(sitter, "delivered")
    assert done.end_reason == ""
    known = {(t.run, t.trial): t for t in done.state.trials if t.delivered_mps2 and t.phase is Phase.TEST}
    pairs = [(each.delivered, known[each.run, each.trial]) for each in felt if each.delivered and each.run > 0]
    assert len(pairs) == len(known) > 20
    along = np.array([seen.along_mps2 / trial.delivered_mps2 for seen, trial in pairs])
    across = np.array([seen.off_axis_mps2 - trial.off_axis_mps2 for seen, trial in pairs])
    assert np.abs(along - 1.0).max() < 0.1
    assert np.abs(across).max() < 0.3


@pytest.mark.slow
def test_the_same_seed_feels_the_same(sitter):
    first = [(t.level_n, t.answer) for t in conducted(sitter, "delivered").state.trials]
    sitter.data = sitter.data.parent / "again"
    assert [(t.level_n, t.answer) for t in conducted(sitter, "delivered").state.trials] == first


@pytest.mark.parametrize("seed", [11, *slow(12, 13)])
def test_who_asks_again_when_unsure_is_flagged_and_within_the_limit(sitter, seed):
    state = conducted(sitter, "repeating", seed).state
    tested = [t for t in state.trials if t.phase is Phase.TEST]
    asked = [t for t in tested if t.void_cause is VoidCause.ASKED]
    assert 3 <= len(asked) <= 2 * sitter.protocol.trial.repeats_per_run
    assert f"REPE{seed}" in format_repeat_warning(state.trials)


@pytest.mark.parametrize(
    "observer",
    [
        "ideal",
        *slow("guesser", "lapsing", "criterion_drift"),
    ],
)
def test_who_asks_for_nothing_is_not_flagged(sitter, observer):
    assert format_repeat_warning(conducted(sitter, observer).state.trials) == ""


@pytest.mark.slow
def test_a_rehearsal_is_of_the_chosen_people_and_goes_on_with_no_others(sitter):
    def rehearsal(observer):
        return Rehearsal(sitter.protocol, sitter.text, 1, 5, sitter.data, observer=observer)

    rehearse_study(rehearsal("repeating"), workers=1, on_finished=lambda _: None)
    (session,) = list_session_folders(sitter.data)
    assert fold_session(session).state.opened.observer == "repeating_1_seed_5"
    with pytest.raises(StudyError, match=r"begun with the observer repeating_1_seed_5"):
        rehearse_study(rehearsal("person"), workers=1, on_finished=lambda _: None)
