"""A followed session as lines of text."""

from dataclasses import replace
from datetime import UTC, datetime

import pytest

from study.store.sessions.event_log import LOG_NAME
from study.tui.watch.watch_lines import format_changes, format_view
from study.tui.watch.watch_words import describe_drifts, format_duration
from study.workflows.views.watch_session import follow

TEXT = (
    'name = "small"\nkind = "study"\ntitle = "A small study"\n[stimulus]\nfrequencies_hz = [25.0]\n'
    "[staircase]\nstart_n = 1.0\ncap_n = 3.0\nup_after_wrong = 1\ndown_after_right = 3\n"
    "steps = [{ step_db = 4.0, reversals = 3 }]\nreversals = 3\naveraged_reversals = 2\n[directions]\n"
    "[safety]\nstimulus_cap_n = 3.0\ntotal_cap_n = 4.5\n"
)


def taken(data, text):
    from protocols.document.loading import load_protocol
    from study.devices.clock import VirtualClock
    from study.workflows.session.conduct_session import conduct_new
    from study.workflows.session.open_session import SessionPlan
    from study.workflows.session.simulated_participant import make_simulated_participant

    plan = SessionPlan(load_protocol(text, "small"), text, False, "S1", "scripted", 3, data)
    return conduct_new(plan, "simulated", make_simulated_participant("scripted", 3, VirtualClock())).folder


@pytest.fixture(scope="module")
def views(tmp_path_factory):
    """After each line of a whole session."""
    data = tmp_path_factory.mktemp("data")
    whole = taken(data, TEXT)
    growing = data / "copy" / whole.name
    growing.mkdir(parents=True)
    follower, seen = follow(growing), []
    for line in whole.log.read_bytes().splitlines(keepends=True):
        with (growing / LOG_NAME).open("ab") as file:
            file.write(line)
        seen.append(follower.look(datetime.now(UTC).isoformat(timespec="milliseconds")))
    return seen


def told(views) -> list[str]:
    return [line for before, now in zip([None, *views], views, strict=False) for line in format_changes(before, now)]


@pytest.mark.slow
def test_each_trial_is_reported_once_when_it_is_closed(views):
    lines = [line for line in told(views[:-1]) if line.startswith("trial ") and "shown" in line]
    assert len(lines) == views[-1].answers
    assert lines[0].startswith("trial 1 at 25 Hz, 1 N: ")
    assert sum(", reversal" in line for line in lines) == 3


@pytest.mark.slow
def test_nothing_is_told_twice(views):
    assert format_changes(views[-1], views[-1]) == []


def test_motion_across_that_was_not_measured_is_not_reported_as_none(views):
    view = views[-1]
    assert any(" across" in line for line in format_view(view))
    unknown = replace(view, last=tuple(replace(trial, off_axis_mps2=None) for trial in view.last))
    lines = [line for line in format_view(unknown) if line.startswith("Last")]
    assert any("m/s²" in line for line in lines)
    assert not any("across" in line for line in lines)


def test_the_end_is_reported(views):
    assert told(views)[-1] == "FINISHED: all runs are done"


def test_an_alarm_comes_first_with_a_bell(views):
    lines = format_changes(None, views[0])
    assert lines[0].startswith("\aALARM The program that ran the session is gone.")
    assert lines[0] not in format_changes(views[0], views[1])


def test_the_status_names_all_that_matters(views):
    text = "\n".join(format_view(views[-1]))
    for part in (
        "✓ FINISHED S1_001",
        "3/3 reversals",
        "Time",
        "Dose A(8)",
        "Catch      none so far",
        "Handle",
        "Sensor",
    ):
        assert part in text


@pytest.mark.parametrize(
    ("seconds", "words"), [(4.9, "4 s"), (65.0, "1 min 05 s"), (3720.0, "1 h 02 min"), (0.0, "0 s")]
)
def test_durations_are_rounded_down(seconds, words):
    assert format_duration(seconds) == words


def test_too_little_to_measure_is_no_note_on_each_trial(tmp_path):
    """The participant answers while the stimulus still fades in."""
    text = TEXT.replace("[25.0]\n", "[25.0]\nfade_in_s = 2.0\n")
    view = follow(taken(tmp_path, text).path).look(datetime.now(UTC).isoformat())
    early = tuple(trial for trial in view.last if trial.status == "unmeasured")
    assert early
    assert {(trial.remark, trial.delivered_mps2) for trial in early} == {("", None)}
    assert (
        sum("answered too early, or see remark; counts" in line for line in format_view(replace(view, last=early))) == 1
    )


def test_a_trial_whose_recording_was_lost_is_not_explained_by_an_early_answer_alone(views):
    lost = "its recording was lost when the program ended"
    rows = tuple(replace(trial, status="unmeasured", delivered_mps2=None, remark=lost) for trial in views[-1].last)
    lines = format_view(replace(views[-1], last=rows))
    assert sum(line.endswith(f"not measured, {lost}") for line in lines) > 0
    assert [line.strip() for line in lines if "not measured:" in line] == [
        "not measured: answered too early, or see remark; counts"
    ]


def test_a_single_probe_is_not_told_in_the_plural(views):
    assert [describe_drifts(replace(views[-1], probes=count)) for count in (0, 1, 2)] == [
        "", "none in 1 probe", "none in 2 probes",
    ]  # fmt: skip
