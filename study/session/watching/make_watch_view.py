"""The experimenter's view of a followed session. Pure: the same session and time give the same view."""

from dataclasses import dataclass

from protocols.trial import Phase
from study.session.facts.log_time import Moment, compute_wall_clock_s
from study.session.state.sitting_state import SittingState, compute_daily_dose, pass_time
from study.session.state.vibration_dose import compute_a8_mps2
from study.session.views.archive_views import INELIGIBILITY_REASONS
from study.session.watching.followed_session import FollowedSession
from study.session.watching.followed_trials import (
    collect_points,
    collect_practice_results,
    find_shown_run,
    list_last_trials,
    make_open_trial,
    make_run_line,
    next_level_n,
)
from study.session.watching.live_state import Live
from study.session.watching.watch_alarms import Situation, find_alarms
from study.session.watching.watch_view import RUNNING_STATUSES, DriftRecord, Exposure, SittingStatus, WatchView


@dataclass(frozen=True, slots=True)
class LiveInfo:
    """What is known about a session besides its log."""

    live: Live | None = None
    writer: bool | None = None
    """Whether a program holds the session's lock; None if not checked."""
    problem: str = ""
    """Why the log cannot be followed any further; empty where it can."""
    drifts: tuple[DriftRecord, ...] = ()


def make_watch_view(
    watched: FollowedSession, live_info: LiveInfo, now_utc: str, previous_view: WatchView | None = None
) -> WatchView:
    """The view at `now_utc`. previous_view: the last one, so that a lasting alarm keeps its start time."""
    state, run = watched.state, find_shown_run(watched.state)
    situation = _make_situation(watched, live_info, now_utc)
    live, status = situation.live, situation.standing
    activity, since_utc = _describe_activity(watched, live, status)
    catches = [trial for trial in state.trials if trial.phase is Phase.CATCH and trial.is_valid]
    return WatchView(
        utc=now_utc,
        session=state.opened.session,
        subject=state.opened.subject,
        protocol=state.protocol.title,
        device=state.opened.device.name,
        simulated=state.opened.device.simulated,
        observer=state.opened.observer,
        standing=status,
        reason=_describe_reason(watched, status),
        activity=activity,
        activity_s=situation.open_s or _seconds_between(since_utc, now_utc),
        runs=tuple(make_run_line(state, run) for run in state.runs),
        shown_run=run,
        points=collect_points(state, run),
        next_level_n=next_level_n(state, run),
        cap_n=state.protocol.staircase.cap_n,
        open_trial=make_open_trial(state, situation.open_s),
        last=list_last_trials(watched),
        answers=state.answers,
        exposure=situation.exposure,
        catch_given=len(catches),
        catch_lapses=sum(not trial.correct for trial in catches),
        practice=collect_practice_results(state),
        forms=watched.forms,
        notes=watched.notes[::-1],
        gate_radius_mm=state.protocol.gate.radius_mm,
        live=live if status in RUNNING_STATUSES and situation.is_live_fresh else None,
        alarms=find_alarms(situation, previous_view.alarms if previous_view is not None else ()),
        probes=len(watched.probes),
        drifts=live_info.drifts,
    )


def _make_situation(watched: FollowedSession, live_info: LiveInfo, now_utc: str) -> Situation:
    live = _select_live(watched, live_info.live)
    status = _find_status(watched, live, live_info.writer)
    exposure = _compute_exposure(watched, live, status, now_utc)
    return Situation(watched, live, live_info.problem, status, exposure, now_utc, live_info.drifts)


def _select_live(watched: FollowedSession, live: Live | None) -> Live | None:
    """The live state, unless it is left over from an earlier sitting. Versions that log the monotonic clock remove
    it before a sitting; for others the times decide."""
    is_current = live is not None and (live.monotonic_s is not None or live.utc >= watched.sitting_utc)
    return live if is_current else None


def _find_status(watched: FollowedSession, live: Live | None, writer: bool | None) -> SittingStatus:
    if watched.state.is_finally_ineligible:
        return watched.state.sitting.ineligibility or "refused"
    if watched.state.closed:
        return "finished"
    if watched.end_reason:
        return "stopped"
    if writer is False:
        return "not running"
    if live is not None and live.activity == "pause":
        return "paused"
    resting = live.activity == "rest" if live is not None else watched.state.rest_due_s > 0
    return "resting" if resting else "running"


def _describe_reason(watched: FollowedSession, status: SittingStatus) -> str:
    match status:
        case "stopped":
            return watched.end_reason
        case "not running":
            return "its program is gone; every answer is on disk"
        case "finished":
            return "all runs are done"
        case "refused" | "excluded":
            return f"{INELIGIBILITY_REASONS[status]}; the person does not take part"
        case _:
            return ""


_WORDS = {
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
"""Each `Activity` in words."""


def _describe_activity(watched: FollowedSession, live: Live | None, status: SittingStatus) -> tuple[str, str]:
    """Activity in words, and since when. The log takes precedence over `live`."""
    state = watched.state
    if status not in RUNNING_STATUSES:
        return status, watched.last_utc
    if state.presented is not None:
        waiting = state.answered is None
        return ("waiting for the answer" if waiting else "measuring"), (state.answered or state.presented).utc
    if live is None:
        return ("resting" if status == "resting" else "between two trials"), watched.last_utc
    return _WORDS[live.activity], live.since_utc


def _compute_exposure(watched: FollowedSession, live: Live | None, status: SittingStatus, now_utc: str) -> Exposure:
    state, limits = watched.state, watched.state.protocol.limits
    sitting = _advance_to_now(state.sitting, live, now_utc) if status in RUNNING_STATUSES else state.sitting
    return Exposure(
        elapsed_min=(sitting.sitting_elapsed_s or 0.0) / 60.0,
        limit_min=limits.longest_min,
        dose_a8_mps2=compute_a8_mps2(compute_daily_dose(sitting)),
        dose_limit_mps2=limits.dose_a8_mps2,
    )


def _advance_to_now(sitting: SittingState, live: Live | None, now_utc: str) -> SittingState:
    """The sitting advanced to now, by the session's monotonic clock if its live state has it, otherwise by this
    computer's clock."""
    stamped = live is not None and live.monotonic_s is not None and sitting.last_moment.monotonic_s is not None
    if live is not None and stamped:
        return pass_time(sitting, Moment(live.utc, live.monotonic_s))
    return pass_time(sitting, Moment(now_utc))


def _seconds_between(since_utc: str, now_utc: str) -> float:
    """Seconds between two times, never negative: the clocks of two computers differ."""
    return max(0.0, compute_wall_clock_s(since_utc, now_utc))
