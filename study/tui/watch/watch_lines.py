"""A running session as lines of text, for `hapteq watch --plain` and for a terminal without a screen program.

`changes` gives one line for each difference between two views, `status` the whole view. What a view may contain, so
that the experimenter cannot give away an answer, is decided in `watch_view`.
"""

from study.session.watching.watch_view import ClosedTrial, WatchView
from study.tui.watch.watch_words import (
    NOT_MEASURED,
    SYMBOLS,
    catch_words,
    clock_time,
    describe_activity,
    device_words,
    dose_words,
    drift_words,
    handle_words,
    not_measured,
    reversals,
    run_name,
    sensor_words,
    staircase_title,
    time_words,
    verdict,
)

BELL = "\a"
"""Character that makes a terminal ring."""
LABEL_CELLS = 11
"""Width of the label at the start of each line of `status`, in character cells; long lines are indented by it."""


def changes(previous: WatchView | None, current: WatchView) -> list[str]:
    """One line for each change from one view to the next: alarms first, each with a bell, then trials, notes (oldest
    first), drifts, the staircase and the state of the session. previous: None at the start: the whole view follows the
    alarms."""
    reported = {(alarm.kind, alarm.since) for alarm in previous.alarms} if previous is not None else set()
    lines = [f"{BELL}ALARM {alarm.sentence}" for alarm in current.alarms if (alarm.kind, alarm.since) not in reported]
    if previous is None:
        return [*lines, *status(current)]
    lines += [_trial_line(trial) for trial in _new_trials(previous, current)]
    known_notes = len(previous.notes)
    lines += [
        f"Note by the {note.who}: {note.text}" for note in current.notes[: len(current.notes) - known_notes][::-1]
    ]
    known_drifts = {drift.sentence for drift in previous.drifts}
    lines += [f"Drift: {drift.sentence}" for drift in current.drifts if drift.sentence not in known_drifts]
    if current.shown_run != previous.shown_run and current.shown_run is not None:
        lines.append(staircase_title(current))
    if current.standing != previous.standing:
        lines.append(f"{current.standing.upper()}: {describe_activity(current)}")
    return lines


def status(view: WatchView) -> list[str]:
    """The whole view: a labelled line for each of its parts, with the three latest trials and the three latest
    notes."""
    lines = [
        f"{SYMBOLS[view.standing]} {view.standing.upper()} {view.session}: {describe_activity(view)}",
        f"Protocol   {view.protocol}; {view.answers} answers",
        f"Staircase  {staircase_title(view)}",
        f"Time       {time_words(view.exposure)} of this sitting",
        f"Dose A(8)  {dose_words(view.exposure)}",
        f"Catch      {catch_words(view)}",
        f"Handle     {handle_words(view)}",
        f"Sensor     {sensor_words(view)}",
        f"Device     {view.device}: {device_words(view)}",
    ]
    if view.probes:
        lines.append(f"Drift      {drift_words(view)}")
    lines += [f"Drift      {drift.sentence}{' BEYOND THE LIMIT' if drift.beyond else ''}" for drift in view.drifts]
    for run in view.runs:
        lines.append(f"Run        {run_name(view, run)}, {run.frequency_hz:g} Hz: {run.status}, {run.trials} trials")
        if run.reversals_needed:
            lines[-1] += f", {reversals(run)} reversals"
    lines += [f"Last       {_trial_line(trial)}" for trial in view.last[:3]]
    if any(map(not_measured, view.last[:3])):
        lines.append(f"           not measured: {NOT_MEASURED}")
    lines += [f"Note       {clock_time(note.utc)} {note.who}: {note.text}" for note in view.notes[:3]]
    return lines


def _new_trials(previous: WatchView, current: WatchView) -> list[ClosedTrial]:
    """Trials that were not in the view before, oldest first. A trial that is still being measured is left to a later
    view."""
    reported = {(t.run, t.trial, t.attempt) for t in previous.last if t.status != "measuring"}
    unreported = [t for t in current.last if (t.run, t.trial, t.attempt) not in reported and t.status != "measuring"]
    # A view holds the latest trials only: one before the newest of the previous view was reported long ago.
    newest = (previous.last[0].run, previous.last[0].trial, previous.last[0].attempt) if previous.last else (-1, 0, 0)
    return [t for t in unreported[::-1] if (t.run, t.trial, t.attempt) >= newest]


def _trial_line(trial: ClosedTrial) -> str:
    """A trial with its frequency, level, verdict, answer, response time and measured acceleration; numbers from 1."""
    parts = [f"trial {trial.trial + 1} at {trial.frequency_hz:g} Hz, {trial.level_n:.3g} N: {verdict(trial)}"]
    if trial.answer is not None:
        parts.append(f"shown {trial.shown}, said {trial.answer}" if trial.shown else f"said {trial.answer}")
    if trial.response_time_s is not None:
        parts.append(f"{trial.response_time_s:.1f} s")
    if trial.delivered_mps2 is not None:
        off_axis_text = "" if trial.off_axis_mps2 is None else f", {trial.off_axis_mps2:.1f} across"
        parts.append(f"{trial.delivered_mps2:.1f} m/s²{off_axis_text}")
    elif not_measured(trial):
        parts.append("not measured")
    if trial.reversal:
        parts.append("reversal")
    return ", ".join([*parts, *([trial.remark] if trial.remark else [])])
