"""Format the panels of the experimenter's view as styled text, for `watch_screen`: status, alarms, runs, last trials,
exposure and device, details.

Functions from a `WatchView` or its parts to text, with times in the zone of this computer; numbers of runs and trials,
which count from 0 in a view, are shown from 1.
"""

from collections.abc import Sequence

from textual.content import Content

from study.session.watching.watch_view import Alarm, ClosedTrial, RunStatus, WatchedRun, WatchView
from study.tui.watch.watch_words import (
    MUTED,
    NOT_MEASURED_LEGEND,
    NOT_MEASURED_MARK,
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
    is_unmeasured,
    name_verdict,
)

StyledText = Content | str | tuple[str, str]
"""A part of a line: text, text with its style, or content."""

_RUN_SYMBOLS: dict[RunStatus, str] = {"done": "✓", "present": "▶", "to come": " "}
"""Symbol of the state of a run, a single character."""
_VERDICT_STYLES = {"right": "$text-success", "wrong": "$text-error", "LAPSE": "bold $text-error"}
"""Style of a trial's result."""
BAR_LENGTH_CELLS = 6
"""Length of a bar in character cells (chosen)."""


def format_status_line(view: WatchView) -> Content:
    """Format a line with the status of the session, its name, and its present activity."""
    symbol, style = STATUS_SYMBOLS[view.standing]
    status = (f"{symbol} {view.standing.upper()}", style)
    return Content.assemble(status, "  ", (view.session, "bold"), f"  {describe_activity(view)}")


def format_alarms(new_alarms: Sequence[Alarm], acknowledged_alarms: Sequence[Alarm]) -> Content:
    """Format alarms: new ones first, with their start times, acknowledged ones below."""
    new_lines = [
        Content.assemble((f"▲ {alarm.sentence}", "bold $text-error"), (f"  since {format_local_time(alarm.since)}", ""))
        for alarm in new_alarms
    ]
    acknowledged_lines = [Content.styled(f"  seen: {alarm.sentence}", MUTED) for alarm in acknowledged_alarms]
    return Content("\n").join([*new_lines, *acknowledged_lines])


def format_runs(view: WatchView, rows: int) -> Content:
    """Format the table of the runs: name, frequency (Hz), reversals and number of trials. It shows as many runs as fit
    into `rows` lines with the header, the current run among them."""
    lines = [Content.styled("  run            Hz  rev.  n", MUTED)]
    lines += [_format_run(view, run) for run in _select_runs_near_current(view.runs, rows - 1)]
    return Content("\n").join(lines)


def format_trials(view: WatchView, rows: int, columns: int) -> Content:
    """Format the table of the latest trials, newest first: level (N), direction and answer, response time (s),
    acceleration (m/s²) along the direction and across it. The open trial is listed without its direction; a legend
    follows where a trial was not measured and there is room for it. rows, columns: available space, in cells."""
    header = "trial     N shown said           s m/s²  off"
    # 10 columns: two blanks and the 8 columns from which `_format_trial` writes a remark.
    lines = [Content.styled(f"{header}  remark" if columns >= len(header) + 10 else header, MUTED)]
    open_trial = view.open_trial
    if open_trial is not None:
        lines.append(Content(f"{open_trial.trial + 1:>5} {open_trial.level_n:5.3g}  hidden until it is answered"))
    free_rows = max(0, rows - len(lines))
    legend_lines = [Content.styled(f"{NOT_MEASURED_MARK} {NOT_MEASURED_LEGEND}", MUTED)]
    has_legend = free_rows > 1 and any(map(is_unmeasured, view.last[: free_rows - 1]))
    lines += [_format_trial(closed_trial, columns) for closed_trial in view.last[: free_rows - has_legend]]
    lines += legend_lines * has_legend
    return Content("\n").join(lines)


def format_gauges(view: WatchView) -> Content:
    """Format elapsed time (min) and vibration dose A(8) (m/s²) as bars with numbers; catch trials, handle, sensor,
    device and, with probes, drift in words."""
    exposure = view.exposure
    labelled_values: list[tuple[str, Content]] = [
        ("Time", _format_bar(exposure.time_share, describe_elapsed_time(exposure))),
        ("A(8)", _format_bar(exposure.dose_share, describe_dose(exposure))),
        ("Catch", Content.styled(describe_catch_trials(view), "bold $text-error" if view.catch_lapses else "")),
        ("Handle", Content(describe_handle(view))),
        ("Sensor", Content(describe_sensor(view))),
        ("Device", Content(describe_device(view))),
    ]
    if view.probes:
        has_excessive_drift = any(drift.beyond for drift in view.drifts)
        labelled_values.append(
            ("Drift", Content.styled(describe_drifts(view), "bold $text-error" if has_excessive_drift else ""))
        )
    return Content("\n").join(Content.assemble((f"{name:<6} ", MUTED), text) for name, text in labelled_values)


def format_details(view: WatchView) -> Content:
    """Format participant, device, forms, practice, drift and notes as text, in sections."""
    participant_text = f"simulated '{view.observer}'" if view.observer else "a person"
    answers_text = "1 answer" if view.answers == 1 else f"{view.answers} answers"
    section_parts: list[StyledText] = [
        *_format_section(
            "Session", [f"{view.subject}, {participant_text}, {answers_text}", view.protocol, f"Device: {view.device}"]
        ),
        *_format_section(
            "Forms",
            [f"{format_local_time(form.utc)}  {form.form}: {_describe_outcome(form.passed)}" for form in view.forms],
        ),
        *_format_section(
            "Practice",
            [
                f"{result.frequency_hz:g} Hz: {result.right} right of {result.of}, {_describe_outcome(result.passed)}"
                for result in view.practice
            ],
        ),
        *(_format_section("Drift", [drift.sentence for drift in view.drifts]) if view.probes else ()),
        *_format_section(
            "Notes",
            [
                f"{format_local_time(note.utc)}  {'ADVERSE ' if note.adverse else ''}{note.who}: {note.text}"
                for note in view.notes
            ],
        ),
    ]
    return Content.assemble(*section_parts)


def _format_section(title: str, lines: Sequence[str]) -> list[StyledText]:
    """Format a titled section; "none so far" without lines."""
    return [(f"{title}\n", "bold"), *(f"{line}\n" for line in lines or ["none so far"]), "\n"]


def _describe_outcome(passed: bool) -> str:
    """Describe whether a form or a practice was passed."""
    return "passed" if passed else "NOT passed"


def _select_runs_near_current(runs: tuple[WatchedRun, ...], max_runs: int) -> tuple[WatchedRun, ...]:
    """Select at most `max_runs` consecutive runs (at least 1), with the current run near their middle; the last runs
    where there is no current run."""
    current_index = next((index for index, run in enumerate(runs) if run.status == "present"), len(runs) - 1)
    first_index = max(0, min(current_index - max_runs // 2, len(runs) - max_runs))
    return runs[first_index : first_index + max(1, max_runs)]


def _format_run(view: WatchView, run: WatchedRun) -> Content:
    """Format a row of the table of runs."""
    name = f"{_RUN_SYMBOLS[run.status]} {format_run_name(view, run):<12}"
    text = f"{name} {run.frequency_hz:4g} {format_reversals(run):>5} {run.trials:>2}"
    return Content.styled(text, {"present": "bold", "done": "", "to come": MUTED}[run.status])


def _format_trial(trial: ClosedTrial, columns: int) -> Content:
    """Format a row of the table of trials. The remark is cut to the remaining columns; where fewer than 8 remain, "!"
    marks that there is one. A "+" after the number marks each repetition, up to two."""
    verdict = name_verdict(trial)
    number_text = f"{trial.trial + 1}{'+' * min(trial.attempt, 2)}"
    left_text = (
        f"{number_text:>5} {trial.level_n:5.3g} {_format_integer(trial.shown, 5)} {_format_integer(trial.answer, 4)} "
    )
    delivered_text = NOT_MEASURED_MARK if is_unmeasured(trial) else _format_decimal(trial.delivered_mps2, 4)
    right_text = (
        f"{_format_decimal(trial.response_time_s, 4)} {delivered_text} {_format_decimal(trial.off_axis_mps2, 4)}"
    )
    reversal_mark = "↺" if trial.reversal else " "
    # 9 columns: the result (5), the mark of a reversal with a blank (2), two blanks before the remark.
    remark_columns = columns - len(left_text) - len(right_text) - 9
    remark = trial.remark or ("measuring" if trial.status == "measuring" else "")
    if trial.phase == "catch":
        remark = f"catch {remark}".rstrip()
    shortened_remark = remark if len(remark) <= remark_columns else f"{remark[: remark_columns - 1]}…"
    remark_text = f"  {shortened_remark}" if remark_columns >= 8 else " !" if remark else ""
    return Content.assemble(
        left_text,
        (f"{verdict:<5}", _VERDICT_STYLES.get(verdict, MUTED)),
        f"{reversal_mark} {right_text}",
        (remark_text, MUTED),
    )


def _format_integer(value: int | None, width: int) -> str:
    """Format a whole number, right-aligned to `width` characters; a dash for None."""
    return f"{'–' if value is None else value:>{width}}"


def _format_decimal(value: float | None, width: int) -> str:
    """Format a number with one decimal, right-aligned to `width` characters; a dash for None."""
    return f"{'–' if value is None else format(value, '.1f'):>{width}}"


def _format_bar(share: float, description: str) -> Content:
    """Format a bar for a share of a limit (from 0; 1 and more fill it), with a description: in the style of a warning
    from 0.8 (chosen: the limit comes near), of an error from 1."""
    filled_cells = round(min(1.0, share) * BAR_LENGTH_CELLS)
    style = "bold $text-error" if share >= 1 else "bold $text-warning" if share >= 0.8 else ""
    return Content.assemble(
        ("█" * filled_cells, style), ("░" * (BAR_LENGTH_CELLS - filled_cells), MUTED), (f" {description}", style)
    )
