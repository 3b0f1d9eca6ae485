"""The experimenter's view of a followed session, computed from its log, its live state and the time without side
effects (`make_watch_view`)."""

from dataclasses import dataclass

from protocols.trial import Phase
from study.session.facts.log_time import Moment, compute_wall_clock_s
from study.session.state.sitting_state import SittingState, compute_daily_dose, pass_time
from study.session.state.vibration_dose import compute_a8_mps2
from study.session.views.archive_views import INELIGIBILITY_REASONS
from study.session.watching.followed_session import FollowedSession
from study.session.watching.followed_trials import (
    collect_practice_results,
    collect_staircase_points,
    find_next_level_n,
    find_shown_run,
    list_last_trials,
    make_open_trial,
    make_watched_run,
)
from study.session.watching.live_state import LiveState
from study.session.watching.watch_alarms import Situation, find_alarms
from study.session.watching.watch_view import RUNNING_STATUSES, DriftRecord, Exposure, SittingStatus, WatchView


@dataclass(frozen=True, slots=True)
class LiveInfo:
    """Information on a session from sources other than its log."""

    live: LiveState | None = None
    """Live state; None without a readable one."""
    has_writer: bool | None = None
    """Whether a program holds the session's lock; None if not checked."""
    problem: str = ""
    """Why the log cannot be followed any further; empty where it can."""
    drifts: tuple[DriftRecord, ...] = ()
    """Changes of device or grip, measured by the probes."""


def make_watch_view(
    session: FollowedSession, live_info: LiveInfo, now_utc: str, previous_view: WatchView | None = None
) -> WatchView:
    """Make the view at `now_utc` (ISO 8601). previous_view: the previous one, so that a lasting alarm keeps its start
    time."""
    state, shown_run = session.state, find_shown_run(session.state)
    situation = _make_situation(session, live_info, now_utc)
    live_state, status = situation.live, situation.standing
    activity, since_utc = _describe_activity(session, live_state, status)
    catch_trials = [trial for trial in state.trials if trial.phase is Phase.CATCH and trial.is_valid]
    return WatchView(
        utc=now_utc,
        session=state.opened.session,
        subject=state.opened.subject,
        protocol=state.protocol.title,
        device=state.opened.device.name,
        simulated=state.opened.device.simulated,
        observer=state.opened.observer,
        standing=status,
        reason=_describe_reason(session, status),
        activity=activity,
        activity_s=situation.open_s or max(0.0, compute_wall_clock_s(since_utc, now_utc)),  # 0: clocks differ
        runs=tuple(make_watched_run(state, run) for run in state.runs),
        shown_run=shown_run,
        points=collect_staircase_points(state, shown_run),
        next_level_n=find_next_level_n(state, shown_run),
        cap_n=state.protocol.staircase.cap_n,
        open_trial=make_open_trial(state, situation.open_s),
        last=list_last_trials(session),
        answers=state.answers,
        exposure=situation.exposure,
        catch_given=len(catch_trials),
        catch_lapses=sum(not trial.correct for trial in catch_trials),
        practice=collect_practice_results(state),
        forms=session.forms,
        notes=session.notes[::-1],
        gate_radius_mm=state.protocol.gate.radius_mm,
        live=live_state if status in RUNNING_STATUSES and situation.is_live_fresh else None,
        alarms=find_alarms(situation, previous_view.alarms if previous_view is not None else ()),
        probes=sum(bool(probe.recording and not probe.trouble) for probe in session.probes),
        drifts=live_info.drifts,
    )


def _make_situation(session: FollowedSession, live_info: LiveInfo, now_utc: str) -> Situation:
    """Collect the state from which the alarms are decided."""
    live_state = _select_current_live_state(session, live_info.live)
    status = _determine_status(session, live_state, live_info.has_writer)
    exposure = _compute_exposure(session, live_state, status, now_utc)
    return Situation(session, live_state, live_info.problem, status, exposure, now_utc, live_info.drifts)


def _select_current_live_state(session: FollowedSession, live_state: LiveState | None) -> LiveState | None:
    """Select the live state if it is of the current sitting, otherwise None. Versions that log the monotonic clock
    remove the live state before a sitting; for older ones its time is compared with the beginning of the sitting."""
    is_current = live_state is not None and (
        live_state.monotonic_s is not None or live_state.utc >= session.sitting_utc
    )
    return live_state if is_current else None


def _determine_status(session: FollowedSession, live_state: LiveState | None, has_writer: bool | None) -> SittingStatus:
    """Determine the status of the session by its log, the lock (`LiveInfo.has_writer`) and the live state, in order."""
    if session.state.is_finally_ineligible:
        return session.state.sitting.ineligibility or "refused"
    if session.state.closed:
        return "finished"
    if session.end_reason:
        return "stopped"
    if has_writer is False:
        return "not running"
    if live_state is not None and live_state.activity == "pause":
        return "paused"
    is_resting = live_state.activity == "rest" if live_state is not None else session.state.rest_due_s > 0
    return "resting" if is_resting else "running"


def _describe_reason(session: FollowedSession, status: SittingStatus) -> str:
    """Describe the reason of the status in words; empty for a running, paused or resting session."""
    match status:
        case "stopped":
            return session.end_reason
        case "not running":
            return "its program is gone; every answer is on disk"
        case "finished":
            return "all runs are done"
        case "refused" | "excluded":
            return f"{INELIGIBILITY_REASONS[status]}; the person does not take part"
        case _:
            return ""


_ACTIVITY_WORDS = {
    "preparing": "getting ready",
    "form": "filling in a form",
    "instructions": "reading the instructions",
    "demo": "feeling the demonstration",
    "waiting for the handle": "waiting for the handle to come to its place",
    "trial": "between two trials",
    "rest": "resting",
    "pause": "pausing",
    "idle": "between two trials",
    "probe": "a probe between two trials",
    "reference": "the reference, hands off the handle",
}
"""Each `Activity` in words. "trial" is used only where the log has no open trial, hence "between two trials"."""


def _describe_activity(
    session: FollowedSession, live_state: LiveState | None, status: SittingStatus
) -> tuple[str, str]:
    """Describe the activity in words, with the UTC time at which it began. The log takes precedence over the live
    state."""
    state = session.state
    if status not in RUNNING_STATUSES:
        return status, session.last_utc
    if state.presented is not None:
        is_unanswered = state.answered is None
        return ("waiting for the answer" if is_unanswered else "measuring"), (state.answered or state.presented).utc
    if live_state is None:
        return ("resting" if status == "resting" else "between two trials"), session.last_utc
    return _ACTIVITY_WORDS[live_state.activity], live_state.since_utc


def _compute_exposure(
    session: FollowedSession, live_state: LiveState | None, status: SittingStatus, now_utc: str
) -> Exposure:
    """Compute the duration of the sitting and the daily vibration dose, with their limits: at present
    (`_advance_to_now`) while the session runs, otherwise at the last entry of the log."""
    state, limits = session.state, session.state.protocol.limits
    sitting = _advance_to_now(state.sitting, live_state, now_utc) if status in RUNNING_STATUSES else state.sitting
    return Exposure(
        elapsed_min=(sitting.sitting_elapsed_s or 0.0) / 60.0,
        limit_min=limits.longest_min,
        dose_a8_mps2=compute_a8_mps2(compute_daily_dose(sitting)),
        dose_limit_mps2=limits.dose_a8_mps2,
    )


def _advance_to_now(sitting: SittingState, live_state: LiveState | None, now_utc: str) -> SittingState:
    """Advance the sitting to the live state, where that and the log state the session's monotonic clock; otherwise to
    `now_utc`, the wall clock of this computer."""
    has_monotonic_time = (
        live_state is not None and live_state.monotonic_s is not None and sitting.last_moment.monotonic_s is not None
    )
    if live_state is not None and has_monotonic_time:
        return pass_time(sitting, Moment(live_state.utc, live_state.monotonic_s))
    return pass_time(sitting, Moment(now_utc))
