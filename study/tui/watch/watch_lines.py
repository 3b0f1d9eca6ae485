"""A watched session as lines of text: changes between two views, or one whole view."""

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
"""Lets the terminal ring."""
LABEL_CELLS = 11
"""Width of the words before each line of `status`."""


def changes(before: WatchView | None, now: WatchView) -> list[str]:
    """One line for each change, alarms first, each with a bell. Without a previous view: the current state."""
    reported = {(alarm.kind, alarm.since) for alarm in before.alarms} if before is not None else set()
    lines = [f"{BELL}ALARM {alarm.sentence}" for alarm in now.alarms if (alarm.kind, alarm.since) not in reported]
    if before is None:
        return [*lines, *status(now)]
    lines += [_trial_line(trial) for trial in _new_trials(before, now)]
    known = len(before.notes)
    lines += [f"Note by the {note.who}: {note.text}" for note in now.notes[: len(now.notes) - known][::-1]]
    known_drifts = {drift.sentence for drift in before.drifts}
    lines += [f"Drift: {drift.sentence}" for drift in now.drifts if drift.sentence not in known_drifts]
    if now.shown_run != before.shown_run and now.shown_run is not None:
        lines.append(staircase_title(now))
    if now.standing != before.standing:
        lines.append(f"{now.standing.upper()}: {describe_activity(now)}")
    return lines


def status(view: WatchView) -> list[str]:
    """The whole view, without what is in the log anyway."""
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
    lines += [f"Drift      {drift.sentence}{' BEYOND' if drift.beyond else ''}" for drift in view.drifts]
    for run in view.runs:
        lines.append(f"Run        {run_name(view, run)}, {run.frequency_hz:g} Hz: {run.status}, {run.trials} trials")
        if run.reversals_needed:
            lines[-1] += f", {reversals(run)} reversals"
    lines += [f"Last       {_trial_line(trial)}" for trial in view.last[:3]]
    if any(map(not_measured, view.last[:3])):
        lines.append(f"           not measured: {NOT_MEASURED}")
    lines += [f"Note       {clock_time(note.utc)} {note.who}: {note.text}" for note in view.notes[:3]]
    return lines


def _new_trials(before: WatchView, now: WatchView) -> list[ClosedTrial]:
    """Oldest first. A trial that is being measured is reported afterwards."""
    reported = {(t.run, t.trial, t.attempt) for t in before.last if t.status != "measuring"}
    fresh = [t for t in now.last if (t.run, t.trial, t.attempt) not in reported and t.status != "measuring"]
    newest = (before.last[0].run, before.last[0].trial, before.last[0].attempt) if before.last else (-1, 0, 0)
    return [t for t in fresh[::-1] if (t.run, t.trial, t.attempt) >= newest]


def _trial_line(trial: ClosedTrial) -> str:
    parts = [f"trial {trial.trial + 1} at {trial.frequency_hz:g} Hz, {trial.level_n:.3g} N: {verdict(trial)}"]
    if trial.answer is not None:
        parts.append(f"shown {trial.shown}, said {trial.answer}" if trial.shown else f"said {trial.answer}")
    if trial.response_time_s is not None:
        parts.append(f"{trial.response_time_s:.1f} s")
    if trial.delivered_mps2 is not None:
        parts.append(f"{trial.delivered_mps2:.1f} m/s², {trial.off_axis_mps2 or 0.0:.1f} across")
    elif not_measured(trial):
        parts.append("not measured")
    if trial.reversal:
        parts.append("reversal")
    return ", ".join([*parts, *([trial.remark] if trial.remark else [])])
