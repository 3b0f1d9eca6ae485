"""Format the state of a running session as lines of text, for `hapteq watch --plain`, which works without a full-screen
terminal.

`format_changes` gives lines for the differences between two views, `format_view` the whole view. What a view may
contain, so that the experimenter cannot give away an answer, is decided in `watch_view`.
"""

from study.session.watching.watch_view import ClosedTrial, WatchView
from study.tui.watch.watch_words import (
    NOT_MEASURED_LEGEND,
    STATUS_SYMBOLS,
    describe_activity,
    describe_catch_trials,
    describe_device,
    describe_dose,
    describe_drifts,
    describe_elapsed_time,
    describe_handle,
    describe_sensor,
    format_local_time,
    format_reversals,
    format_run_name,
    format_staircase_title,
    is_unmeasured,
    name_verdict,
)

BELL = "\a"
"""Character that makes a terminal ring."""
LABEL_CELLS = 11
"""Width of the label at the start of each line of `format_view`, in character cells; long lines are indented by it."""


def format_changes(previous: WatchView | None, current: WatchView) -> list[str]:
    """Format one line for each change from one view to the next: new alarms first, each with a bell, then closed trials
    and notes (oldest first), drifts, the staircase of another run, and the session's status. previous: None for the
    first view: its alarms are followed by the whole view."""
    reported_alarm_keys = {(alarm.kind, alarm.since) for alarm in previous.alarms} if previous is not None else set()
    lines = [
        f"{BELL}ALARM {alarm.sentence}"
        for alarm in current.alarms
        if (alarm.kind, alarm.since) not in reported_alarm_keys
    ]
    if previous is None:
        return [*lines, *format_view(current)]
    lines += [_format_trial(trial) for trial in _select_new_trials(previous, current)]
    known_note_count = len(previous.notes)
    lines += [
        f"Note by the {note.who}: {note.text}" for note in current.notes[: len(current.notes) - known_note_count][::-1]
    ]
    known_drift_sentences = {drift.sentence for drift in previous.drifts}
    lines += [f"Drift: {drift.sentence}" for drift in current.drifts if drift.sentence not in known_drift_sentences]
    if current.shown_run != previous.shown_run and current.shown_run is not None:
        lines.append(format_staircase_title(current))
    if current.standing != previous.standing:
        lines.append(f"{current.standing.upper()}: {describe_activity(current)}")
    return lines


def format_view(view: WatchView) -> list[str]:
    """Format the whole view: a labelled line for each of its parts, with the three latest trials and notes, latest
    first."""
    lines = [
        f"{STATUS_SYMBOLS[view.standing][0]} {view.standing.upper()} {view.session}: {describe_activity(view)}",
        f"Protocol   {view.protocol}; {view.answers} answers",
        f"Staircase  {format_staircase_title(view)}",
        f"Time       {describe_elapsed_time(view.exposure)} of this sitting",
        f"Dose A(8)  {describe_dose(view.exposure)}",
        f"Catch      {describe_catch_trials(view)}",
        f"Handle     {describe_handle(view)}",
        f"Sensor     {describe_sensor(view)}",
        f"Device     {view.device}: {describe_device(view)}",
    ]
    if view.probes:
        lines.append(f"Drift      {describe_drifts(view)}")
    lines += [f"Drift      {drift.sentence}{' BEYOND THE LIMIT' if drift.beyond else ''}" for drift in view.drifts]
    for run in view.runs:
        lines.append(
            f"Run        {format_run_name(view, run)}, {run.frequency_hz:g} Hz: {run.status}, {run.trials} trials"
        )
        if run.reversals_needed:
            lines[-1] += f", {format_reversals(run)} reversals"
    lines += [f"Last       {_format_trial(trial)}" for trial in view.last[:3]]
    if any(map(is_unmeasured, view.last[:3])):
        lines.append(f"           not measured: {NOT_MEASURED_LEGEND}")
    lines += [f"Note       {format_local_time(note.utc)} {note.who}: {note.text}" for note in view.notes[:3]]
    return lines


def _select_new_trials(previous: WatchView, current: WatchView) -> list[ClosedTrial]:
    """Select the trials that were closed since the previous view, oldest first. A trial that is still being measured is
    left to a later view. Both views list their latest trial first."""
    reported_keys = {(trial.run, trial.trial, trial.attempt) for trial in previous.last if trial.status != "measuring"}
    unreported_trials = [
        trial
        for trial in current.last
        if (trial.run, trial.trial, trial.attempt) not in reported_keys and trial.status != "measuring"
    ]
    # A view holds the latest trials only: one before the newest of the previous view was reported long ago.
    newest_reported_key = (
        (previous.last[0].run, previous.last[0].trial, previous.last[0].attempt) if previous.last else (-1, 0, 0)
    )
    return [
        trial for trial in unreported_trials[::-1] if (trial.run, trial.trial, trial.attempt) >= newest_reported_key
    ]


def _format_trial(trial: ClosedTrial) -> str:
    """Format a trial with its number (from 1), frequency, level, verdict, answer, response time, measured acceleration
    (m/s², along and across the axis), reversal and remark; parts without a value are omitted."""
    parts = [f"trial {trial.trial + 1} at {trial.frequency_hz:g} Hz, {trial.level_n:.3g} N: {name_verdict(trial)}"]
    if trial.answer is not None:
        parts.append(f"shown {trial.shown}, said {trial.answer}" if trial.shown else f"said {trial.answer}")
    if trial.response_time_s is not None:
        parts.append(f"{trial.response_time_s:.1f} s")
    if trial.delivered_mps2 is not None:
        off_axis_text = "" if trial.off_axis_mps2 is None else f", {trial.off_axis_mps2:.1f} across"
        parts.append(f"{trial.delivered_mps2:.1f} m/s²{off_axis_text}")
    elif is_unmeasured(trial):
        parts.append("not measured")
    if trial.reversal:
        parts.append("reversal")
    return ", ".join([*parts, *([trial.remark] if trial.remark else [])])
