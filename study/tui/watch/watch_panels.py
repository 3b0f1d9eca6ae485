"""Panels of the experimenter's view as styled text: status, alarms, runs, last trials, exposure and device, details.

Pure functions from a `WatchView` to text; numbers of runs and trials, which count from 0 in a view, are shown from 1.
"""

from collections.abc import Sequence

from textual.content import Content

from study.session.watching.watch_view import Alarm, ClosedTrial, RunStatus, WatchedRun, WatchView
from study.tui.watch.watch_words import (
    NOT_MEASURED,
    NOT_MEASURED_MARK,
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
    time_words,
    verdict,
)

StyledText = Content | str | tuple[str, str]
"""A part of a line: text, text with its style, or content."""

MUTED = "$foreground 65%"
"""Style of headers, labels and less important text."""
_STANDING_STYLES = {
    "running": "bold $text-success",
    "paused": "bold $text-warning",
    "resting": "bold $text-warning",
    "finished": "bold $text-success",
    "stopped": "bold $text-error",
    "not running": "bold $text-error",
    "refused": MUTED,
    "excluded": MUTED,
}
"""Style of each status of a session."""
_RUN_SYMBOLS: dict[RunStatus, str] = {"done": "✓", "present": "▶", "to come": " "}
"""Symbol of the state of a run, a single character."""
_VERDICT_STYLES = {"right": "$text-success", "wrong": "$text-error", "LAPSE": "bold $text-error"}
"""Style of a trial's result."""
BAR_CELLS = 6
"""Length of a bar in character cells."""


def describe_standing(view: WatchView) -> Content:
    """Status of the session, its name, and what happens at the moment."""
    standing = f"{SYMBOLS[view.standing]} {view.standing.upper()}"
    return Content.assemble(
        (standing, _STANDING_STYLES[view.standing]), "  ", (view.session, "bold"), f"  {describe_activity(view)}"
    )


def alarm_lines(new_alarms: Sequence[Alarm], seen_alarms: Sequence[Alarm]) -> Content:
    """Alarms with their times: new ones first, acknowledged ones below."""
    new_lines = [
        Content.assemble((f"▲ {alarm.sentence}", "bold $text-error"), (f"  since {clock_time(alarm.since)}", ""))
        for alarm in new_alarms
    ]
    seen_lines = [Content.styled(f"  seen: {alarm.sentence}", MUTED) for alarm in seen_alarms]
    return Content("\n").join([*new_lines, *seen_lines])


def runs_lines(view: WatchView, rows: int) -> Content:
    """Table of the runs: frequency (Hz), reversals and number of trials. It shows as many runs as fit into `rows` lines
    with the header, the current run among them."""
    lines = [Content.styled("  run            Hz  rev.  n", MUTED)]
    lines += [_run_line(view, run) for run in _around_the_present(view.runs, rows - 1)]
    return Content("\n").join(lines)


def trials_lines(view: WatchView, rows: int, columns: int) -> Content:
    """Table of the latest trials, newest first: level (N), direction and answer, response time (s), acceleration (m/s²)
    along the direction and across it. The open trial is listed without its direction. rows, columns: room, in cells."""
    header = "trial     N shown said           s m/s²  off"
    lines = [Content.styled(f"{header}  remark" if columns > len(header) + 10 else header, MUTED)]
    trial = view.open_trial
    if trial is not None:
        lines.append(Content(f"{trial.trial + 1:>5} {trial.level_n:5.3g}  hidden until it is answered"))
    room = max(0, rows - len(lines))
    legend = [Content.styled(f"{NOT_MEASURED_MARK} {NOT_MEASURED}", MUTED)]
    has_legend = room > 1 and any(map(not_measured, view.last[: room - 1]))
    lines += [_trial_line(row, columns) for row in view.last[: room - has_legend]]
    lines += legend * has_legend
    return Content("\n").join(lines)


def gauges(view: WatchView) -> Content:
    """Elapsed time (min) and vibration dose A(8) (m/s²) as bars with numbers; catch trials, handle, sensor, device and
    drift in words."""
    exposure = view.exposure
    rows: list[tuple[str, Content]] = [
        ("Time", _bar(exposure.time_share, time_words(exposure))),
        ("A(8)", _bar(exposure.dose_share, dose_words(exposure))),
        ("Catch", Content.styled(catch_words(view), "bold $text-error" if view.catch_lapses else "")),
        ("Handle", Content(handle_words(view))),
        ("Sensor", Content(sensor_words(view))),
        ("Device", Content(device_words(view))),
    ]
    if view.probes:
        over_limit = any(drift.beyond for drift in view.drifts)
        rows.append(("Drift", Content.styled(drift_words(view), "bold $text-error" if over_limit else "")))
    return Content("\n").join(Content.assemble((f"{name:<6} ", MUTED), text) for name, text in rows)


def details(view: WatchView) -> Content:
    """Participant, device, forms, practice, drift and notes as text, in sections."""
    participant = f"simulated '{view.observer}'" if view.observer else "a person"
    answers = "1 answer" if view.answers == 1 else f"{view.answers} answers"
    parts: list[StyledText] = [
        *_section("Session", [f"{view.subject}, {participant}, {answers}", view.protocol, f"Device: {view.device}"]),
        *_section("Forms", [f"{clock_time(f.utc)}  {f.form}: {_outcome_words(f.passed)}" for f in view.forms]),
        *_section(
            "Practice",
            [f"{p.frequency_hz:g} Hz: {p.right} right of {p.of}, {_outcome_words(p.passed)}" for p in view.practice],
        ),
        *(_section("Drift", [d.sentence for d in view.drifts]) if view.probes else ()),
        *_section(
            "Notes",
            [f"{clock_time(n.utc)}  {'ADVERSE ' if n.adverse else ''}{n.who}: {n.text}" for n in view.notes],
        ),
    ]
    return Content.assemble(*parts)


def _section(title: str, lines: Sequence[str]) -> list[StyledText]:
    return [(f"{title}\n", "bold"), *(f"{line}\n" for line in lines or ["none so far"]), "\n"]


def _outcome_words(passed: bool) -> str:
    return "passed" if passed else "NOT passed"


def _around_the_present(runs: tuple[WatchedRun, ...], rows: int) -> tuple[WatchedRun, ...]:
    """At most `rows` consecutive runs, with the current run near their middle; the last runs where there is no current
    run."""
    present_index = next((index for index, run in enumerate(runs) if run.status == "present"), len(runs) - 1)
    first = max(0, min(present_index - rows // 2, len(runs) - rows))
    return runs[first : first + max(1, rows)]


def _run_line(view: WatchView, run: WatchedRun) -> Content:
    name = f"{_RUN_SYMBOLS[run.status]} {run_name(view, run):<12}"
    text = f"{name} {run.frequency_hz:4g} {reversals(run):>5} {run.trials:>2}"
    return Content.styled(text, {"present": "bold", "done": "", "to come": MUTED}[run.status])


def _trial_line(trial: ClosedTrial, columns: int) -> Content:
    """A row of the table of trials. The remark is shortened to the room that is left; with less than 8 columns a "!"
    stands for it. A "+" after the number marks each repetition, up to two."""
    word = verdict(trial)
    number = f"{trial.trial + 1}{'+' * min(trial.attempt, 2)}"
    left_text = f"{number:>5} {trial.level_n:5.3g} {_or_dash(trial.shown, 5)} {_or_dash(trial.answer, 4)} "
    delivered = NOT_MEASURED_MARK if not_measured(trial) else _number(trial.delivered_mps2, 4)
    right_text = f"{_number(trial.response_time_s, 4)} {delivered} {_number(trial.off_axis_mps2, 4)}"
    reversed_here = "↺" if trial.reversal else " "
    room = columns - len(left_text) - len(right_text) - 9
    remark = trial.remark or ("measuring" if trial.status == "measuring" else "")
    if trial.phase == "catch":
        remark = f"catch {remark}".rstrip()
    shortened = remark if len(remark) <= room else f"{remark[: room - 1]}…"
    remark_text = f"  {shortened}" if room >= 8 else " !" if remark else ""
    return Content.assemble(
        left_text,
        (f"{word:<5}", _VERDICT_STYLES.get(word, MUTED)),
        f"{reversed_here} {right_text}",
        (remark_text, MUTED),
    )


def _or_dash(value: int | None, width: int) -> str:
    return f"{'–' if value is None else value:>{width}}"


def _number(value: float | None, width: int) -> str:
    return f"{'–' if value is None else format(value, '.1f'):>{width}}"


def _bar(share: float, words: str) -> Content:
    """A bar for a share of a limit, with words: in the style of a warning from 0.8, of an error from 1."""
    filled_cells = round(min(1.0, share) * BAR_CELLS)
    style = "bold $text-error" if share >= 1 else "bold $text-warning" if share >= 0.8 else ""
    return Content.assemble(
        ("█" * filled_cells, style), ("░" * (BAR_CELLS - filled_cells), MUTED), (f" {words}", style)
    )
