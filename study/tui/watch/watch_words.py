"""Texts of the experimenter's view of a running session, shared by its screen (`watch_screen`, `watch_panels`) and
`hapteq watch --plain` (`watch_lines`)."""

from study.local_clock import convert_to_machine_zone
from study.session.views.local_time import split_time_in_zone
from study.session.watching.watch_view import ClosedTrial, Exposure, SittingStatus, WatchedRun, WatchView

MUTED = "$foreground 65%"
"""Style of headers, labels and less important text."""
STATUS_SYMBOLS: dict[SittingStatus, tuple[str, str]] = {
    "running": ("●", "bold $text-success"),
    "paused": ("‖", "bold $text-warning"),
    "resting": ("◌", "bold $text-warning"),
    "stopped": ("■", "bold $text-error"),
    "finished": ("✓", "bold $text-success"),
    "not running": ("!", "bold $text-error"),
    "refused": ("○", MUTED),
    "excluded": ("○", MUTED),
}
"""Symbol of each status of a session, a single character, and the style of symbol and status."""

NOT_MEASURED_MARK = "n.m."
"""Text in place of an acceleration that was not measured, in the table of trials."""
NOT_MEASURED_LEGEND = "answered too early, or see remark; counts"
"""Explanation of `NOT_MEASURED_MARK`, short enough for a terminal of 80 columns. The remark on the trial states any
other reason than an early answer, such as a lost recording."""


def format_local_time(utc: str) -> str:
    """Format the local time of a UTC time stamp, without the date: "14:05:10 +01:00". A stamp that is no valid time is
    returned unchanged."""
    date, time, offset = split_time_in_zone(utc, convert_to_machine_zone)
    return f"{time} {offset}" if offset else date


def format_duration(duration_s: float) -> str:
    """Format a duration (s, at least 0), rounded down: "4 s", "2 min 05 s", "1 h 02 min"."""
    whole_seconds = int(duration_s)
    if whole_seconds < 60:
        return f"{whole_seconds} s"
    minutes, remaining_seconds = divmod(whole_seconds, 60)
    if minutes < 60:
        return f"{minutes} min {remaining_seconds:02d} s"
    return f"{minutes // 60} h {minutes % 60:02d} min"


def describe_activity(view: WatchView) -> str:
    """Describe the present activity and its duration, such as "trial 12 at 0.5 N: waiting for the answer, 4 s". If the
    session does not run, return the reason that the view states instead."""
    if view.reason:
        return view.reason
    trial, run = view.open_trial, view.present_run
    if trial is None or run is None:
        return f"{view.activity}, {format_duration(view.activity_s)}"
    attempt_text = f", attempt {trial.attempt + 1}" if trial.attempt else ""
    catch_text = ", a catch trial" if trial.catch else ""
    return (
        f"trial {trial.trial + 1}{attempt_text} at {trial.level_n:.3g} N{catch_text}: {view.activity}, "
        f"{format_duration(view.activity_s)}"
    )


def format_run_name(view: WatchView, run: WatchedRun) -> str:
    """Format the name of a run of the view: its phase, and its number in that phase from 1, such as "test 2"."""
    runs_of_phase = [other_run.run for other_run in view.runs if other_run.phase == run.phase]
    return f"{run.phase} {1 + runs_of_phase.index(run.run)}"


def format_reversals(run: WatchedRun) -> str:
    """Format the number of reversals so far and the number that ends the run, such as "3/8"; a dash where reversals do
    not end it."""
    return f"{run.reversals}/{run.reversals_needed}" if run.reversals_needed else "–"


def format_staircase_title(view: WatchView) -> str:
    """Format the title of the staircase plot: run, frequency (Hz), reversals, next level (N) or "run over"; "nothing
    answered yet" without a run to show."""
    shown_run = next((run for run in view.runs if run.run == view.shown_run), None)
    if shown_run is None:
        return "Staircase: nothing answered yet"
    level_text = f", now {view.next_level_n:.3g} N" if view.next_level_n is not None else ", run over"
    reversals_text = (
        f", {shown_run.reversals} of {shown_run.reversals_needed} reversals" if shown_run.reversals_needed else ""
    )
    return f"{format_run_name(view, shown_run)}, {shown_run.frequency_hz:g} Hz{reversals_text}{level_text}"


def name_verdict(trial: ClosedTrial) -> str:
    """Name the result of a trial: "right", "wrong", "void" (spoiled), "…" while it is not known, or "LAPSE" for a catch
    trial answered wrongly."""
    if trial.status == "spoiled":
        return "void"
    if trial.correct is None:
        return "…"
    if trial.correct:
        return "right"
    return "LAPSE" if trial.phase == "catch" else "wrong"


def is_unmeasured(trial: ClosedTrial) -> bool:
    """Whether the trial counts although its acceleration was not measured."""
    return trial.correct is not None and trial.delivered_mps2 is None


def describe_elapsed_time(exposure: Exposure) -> str:
    """Describe the elapsed time of the sitting and its limit (min)."""
    return f"{exposure.elapsed_min:.0f} of {exposure.limit_min:g} min"


def describe_dose(exposure: Exposure) -> str:
    """Describe the daily vibration exposure A(8) and its limit (m/s²)."""
    return f"{exposure.dose_a8_mps2:.2f} of {exposure.dose_limit_mps2:g} m/s²"


def describe_catch_trials(view: WatchView) -> str:
    """Describe the number of lapses (catch trials answered wrongly) and of catch trials that count; "none so far"
    without any."""
    lapses_text = f"{view.catch_lapses} {'lapse' if view.catch_lapses == 1 else 'lapses'}"
    return f"{lapses_text} in {view.catch_given}" if view.catch_given else "none so far"


def describe_handle(view: WatchView) -> str:
    """Describe the distance of the handle from its start position (mm), and the largest distance at which a trial may
    start (mm) if there is a limit; away from its place, that it is; "not read now" without a reading."""
    live_state = view.live
    if live_state is None or live_state.offset_mm is None:
        return "not read now"
    if not live_state.handle_ready:
        return f"{live_state.offset_mm:.1f} mm: OUT of place"
    limit_text = f", {view.gate_radius_mm:g} allowed" if view.gate_radius_mm else ""
    return f"{live_state.offset_mm:.1f} mm off{limit_text}"


def describe_sensor(view: WatchView) -> str:
    """Describe the magnitude of the measured acceleration (m/s²), and whether the sensor's signal is clipped; "not read
    now" without a reading."""
    live_state = view.live
    if live_state is None or live_state.acceleration_mps2 is None:
        return "not read now"
    clipping_text = " CLIPPED" if live_state.sensor_clipped else ""
    return f"{live_state.acceleration_mps2:.1f} m/s²{clipping_text}"


def describe_device(view: WatchView) -> str:
    """Describe the fault of the device; without a fault, whether it is simulated and the number of ticks that its
    control loop missed, else "no fault"; "not read now" without a live state."""
    if view.live is None:
        return "not read now"
    if view.live.fault:
        return f"FAULT: {view.live.fault}"
    parts = ["simulated"] * view.simulated + [f"{view.live.missed_ticks} missed ticks"] * (view.live.missed_ticks > 0)
    return ", ".join(parts) or "no fault"


def describe_drifts(view: WatchView) -> str:
    """Describe the number of drifts that the probes show, and how many exceed their limits; "none in 3 probes" without
    a drift, empty without probes."""
    if not view.probes:
        return ""
    over_limit_count = sum(drift.beyond for drift in view.drifts)
    if not view.drifts:
        return f"none in {view.probes} {'probe' if view.probes == 1 else 'probes'}"
    return f"{len(view.drifts)} changed, {over_limit_count} beyond what is allowed"
