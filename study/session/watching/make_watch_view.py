"""The experimenter's view of a followed session. Pure: the same session and time give the same view."""

from dataclasses import dataclass

from protocols.trial import Phase
from study.session.facts.log_time import Moment, seconds_between
from study.session.state.sitting_state import SittingState, dose_now, pass_time
from study.session.state.vibration_dose import a8_mps2
from study.session.views.archive_views import TURNED_AWAY
from study.session.watching.followed_session import FollowedSession
from study.session.watching.followed_trials import (
    last_trials,
    next_level_n,
    open_trial,
    points,
    practice,
    run_line,
    shown_run,
)
from study.session.watching.live import Live
from study.session.watching.watch_alarms import Situation, alarms_of
from study.session.watching.watch_view import ON, DriftLine, Exposure, Standing, WatchView


@dataclass(frozen=True, slots=True)
class LiveInfo:
    """What is known about a session besides its log."""

    live: Live | None = None
    writer: bool | None = None
    """Whether a program holds the session's lock; None if not checked."""
    problem: str = ""
    """Why the log cannot be followed any further; empty where it can."""
    drifts: tuple[DriftLine, ...] = ()


def watch_view(watched: FollowedSession, beside: LiveInfo, now_utc: str, before: WatchView | None = None) -> WatchView:
    """The view at `now_utc`. before: the previous view, so that a lasting alarm keeps its start time."""
    state = watched.state
    situation = _situation(watched, beside, now_utc)
    live, standing = situation.live, situation.standing
    activity, since_utc = _activity(watched, live, standing)
    catches = [trial for trial in state.trials if trial.phase is Phase.CATCH and trial.counts]
    run = shown_run(state)
    return WatchView(
        utc=now_utc,
        session=state.opened.session,
        subject=state.opened.subject,
        protocol=state.protocol.title,
        device=state.opened.device.name,
        simulated=state.opened.device.simulated,
        observer=state.opened.observer,
        standing=standing,
        reason=_reason(watched, standing),
        activity=activity,
        activity_s=situation.open_s or _seconds(since_utc, now_utc),
        runs=tuple(run_line(state, run) for run in state.runs),
        shown_run=run,
        points=points(state, run),
        next_level_n=next_level_n(state, run),
        cap_n=state.protocol.staircase.cap_n,
        open_trial=open_trial(state, situation.open_s),
        last=last_trials(watched),
        answers=state.answers,
        exposure=situation.exposure,
        catch_given=len(catches),
        catch_lapses=sum(not trial.correct for trial in catches),
        practice=practice(state),
        forms=watched.forms,
        notes=watched.notes[::-1],
        gate_radius_mm=state.protocol.gate.radius_mm,
        live=live if standing in ON and situation.fresh else None,
        alarms=alarms_of(situation, before.alarms if before is not None else ()),
        probes=len(watched.probes),
        drifts=beside.drifts,
    )


def _situation(watched: FollowedSession, beside: LiveInfo, now_utc: str) -> Situation:
    live = _of_this_sitting(watched, beside.live)
    standing = _find_standing(watched, live, beside.writer)
    exposure = _exposure(watched, live, standing, now_utc)
    return Situation(watched, live, beside.problem, standing, exposure, now_utc, beside.drifts)


def _of_this_sitting(watched: FollowedSession, live: Live | None) -> Live | None:
    """The live state, unless it is left over from an earlier sitting. Versions that log the monotonic clock remove
    it before a sitting; for others the times decide."""
    is_current = live is not None and (live.monotonic_s is not None or live.utc >= watched.sitting_utc)
    return live if is_current else None


def _find_standing(watched: FollowedSession, live: Live | None, writer: bool | None) -> Standing:
    if watched.state.turned_away_for_good:
        return watched.state.sitting.turned_away or "refused"
    if watched.state.closed:
        return "finished"
    if watched.left:
        return "stopped"
    if writer is False:
        return "not running"
    if live is not None and live.activity == "pause":
        return "paused"
    resting = live.activity == "rest" if live is not None else watched.state.rest_due_s > 0
    return "resting" if resting else "running"


def _reason(watched: FollowedSession, standing: Standing) -> str:
    match standing:
        case "stopped":
            return watched.left
        case "not running":
            return "its program is gone; every answer is on disk"
        case "finished":
            return "all runs are done"
        case "refused" | "excluded":
            return f"{TURNED_AWAY[standing]}; the person does not take part"
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


def _activity(watched: FollowedSession, live: Live | None, standing: Standing) -> tuple[str, str]:
    """Activity in words, and since when. The log takes precedence over `live`."""
    state = watched.state
    if standing not in ON:
        return standing, watched.last_utc
    if state.presented is not None:
        waiting = state.answered is None
        return ("waiting for the answer" if waiting else "measuring"), (state.answered or state.presented).utc
    if live is None:
        return ("resting" if standing == "resting" else "between two trials"), watched.last_utc
    return _WORDS[live.activity], live.since_utc


def _exposure(watched: FollowedSession, live: Live | None, standing: Standing, now_utc: str) -> Exposure:
    state, limits = watched.state, watched.state.protocol.limits
    sitting = _until_now(state.sitting, live, now_utc) if standing in ON else state.sitting
    return Exposure(
        elapsed_min=(sitting.sat_s or 0.0) / 60.0,
        limit_min=limits.longest_min,
        dose_a8_mps2=a8_mps2(dose_now(sitting)),
        dose_limit_mps2=limits.dose_a8_mps2,
    )


def _until_now(sitting: SittingState, live: Live | None, now_utc: str) -> SittingState:
    """The sitting advanced to now, by the session's monotonic clock if its live state has it, otherwise by this
    computer's clock."""
    stamped = live is not None and live.monotonic_s is not None and sitting.last.monotonic_s is not None
    if live is not None and stamped:
        return pass_time(sitting, Moment(live.utc, live.monotonic_s))
    return pass_time(sitting, Moment(now_utc))


def _seconds(since_utc: str, now_utc: str) -> float:
    """Seconds between two times, never negative: the clocks of two computers differ."""
    return max(0.0, seconds_between(since_utc, now_utc))
