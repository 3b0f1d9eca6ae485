"""Texts of the experimenter's view, shared by its screen (`watch_panels`) and `hapteq watch --plain` (`watch_lines`).

Each function formats a value of a `WatchView` as words or as a number with its unit.
"""

from study.local_clock import convert_to_machine_zone
from study.session.views.local_time import split_time_in_zone
from study.session.watching.watch_view import ClosedTrial, Exposure, SittingStatus, WatchedRun, WatchView

STATUS_SYMBOLS: dict[SittingStatus, str] = {
    "running": "●",
    "paused": "‖",
    "resting": "◌",
    "stopped": "■",
    "finished": "✓",
    "not running": "!",
    "refused": "○",
    "excluded": "○",
}
"""Symbol of each status of a session, a single character."""


NOT_MEASURED_MARK = "n.m."
"""Text in place of an acceleration that was not measured, in the table of trials."""
NOT_MEASURED_LEGEND = "answered too early to measure; counts"
"""Explanation of `NOT_MEASURED_MARK`, short enough for a terminal of 80 columns."""


def format_local_time(utc: str) -> str:
    """Local time of a UTC time stamp, without the date: "14:05:10 +01:00". A stamp that is no valid time is returned as
    it is."""
    date, time, offset = split_time_in_zone(utc, convert_to_machine_zone)
    return f"{time} {offset}" if offset else date


def format_duration(seconds: float) -> str:
    """A duration in words, rounded down: "4 s", "2 min 05 s", "1 h 02 min"."""
    whole_s = int(seconds)
    if whole_s < 60:
        return f"{whole_s} s"
    minutes, seconds_left = divmod(whole_s, 60)
    if minutes < 60:
        return f"{minutes} min {seconds_left:02d} s"
    return f"{minutes // 60} h {minutes % 60:02d} min"


def describe_activity(view: WatchView) -> str:
    """Present activity in words, such as "trial 12 at 0.5 N: waiting for the answer, 4 s". Where the session does not
    run, the reason."""
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
    """Name of a run, numbered within its phase: "test 2"."""
    return f"{run.phase} {1 + [r.run for r in view.runs if r.phase == run.phase].index(run.run)}"


def format_reversals(run: WatchedRun) -> str:
    """Number of reversals so far and number that ends the run, such as "3/8"; a dash for a run without reversals."""
    return f"{run.reversals}/{run.reversals_needed}" if run.reversals_needed else "–"


def format_staircase_title(view: WatchView) -> str:
    """Title of the plot of the staircase: run, frequency (Hz), reversals, next level (N)."""
    shown_run = next((run for run in view.runs if run.run == view.shown_run), None)
    if shown_run is None:
        return "Staircase: nothing answered yet"
    level = f", now {view.next_level_n:.3g} N" if view.next_level_n is not None else ", run over"
    reversals = (
        f", {shown_run.reversals} of {shown_run.reversals_needed} reversals" if shown_run.reversals_needed else ""
    )
    return f"{format_run_name(view, shown_run)}, {shown_run.frequency_hz:g} Hz{reversals}{level}"


def name_verdict(trial: ClosedTrial) -> str:
    """Result of a trial: right, wrong, void, or "…" while it is not known; a catch trial answered wrongly is a
    lapse."""
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
    """Elapsed time of the sitting and its limit (min)."""
    return f"{exposure.elapsed_min:.0f} of {exposure.limit_min:g} min"


def describe_dose(exposure: Exposure) -> str:
    """Vibration dose A(8) and its limit (m/s²)."""
    return f"{exposure.dose_a8_mps2:.2f} of {exposure.dose_limit_mps2:g} m/s²"


def describe_catch_trials(view: WatchView) -> str:
    """Number of lapses (catch trials answered wrongly), and number of catch trials that count."""
    lapses = f"{view.catch_lapses} {'lapse' if view.catch_lapses == 1 else 'lapses'}"
    return f"{lapses} in {view.catch_given}" if view.catch_given else "none so far"


def describe_handle(view: WatchView) -> str:
    """Distance of the handle from its start position (mm), and the largest distance at which a trial may start (mm)."""
    live = view.live
    if live is None or live.offset_mm is None:
        return "not read now"
    if not live.handle_ready:
        return f"{live.offset_mm:.1f} mm: OUT of place"
    allowed = f", {view.gate_radius_mm:g} allowed" if view.gate_radius_mm else ""
    return f"{live.offset_mm:.1f} mm off{allowed}"


def describe_sensor(view: WatchView) -> str:
    """Acceleration measured by the accelerometer (m/s²), and whether its signal is clipped."""
    live = view.live
    if live is None or live.acceleration_mps2 is None:
        return "not read now"
    clipped = " CLIPPED" if live.sensor_clipped else ""
    return f"{live.acceleration_mps2:.1f} m/s²{clipped}"


def describe_device(view: WatchView) -> str:
    """Fault of the device; without a fault, the number of ticks that its control loop missed, and whether it is
    simulated."""
    if view.live is None:
        return "not read now"
    if view.live.fault:
        return f"FAULT: {view.live.fault}"
    parts = ["simulated"] * view.simulated + [f"{view.live.missed_ticks} missed ticks"] * (view.live.missed_ticks > 0)
    return ", ".join(parts) or "no fault"


def describe_drifts(view: WatchView) -> str:
    """Number of drifts that the probes show (friction, gain, delay, grip), and how many exceed their limits; empty
    without probes."""
    if not view.probes:
        return ""
    over_limit = sum(drift.beyond for drift in view.drifts)
    if not view.drifts:
        return f"none in {view.probes} probes"
    return f"{len(view.drifts)} changed, {over_limit} beyond what is allowed"
