"""Alarms for the experimenter who follows a session: faults of device, sensor, computer or program, limits that are
reached, trials that go wrong, and adverse events.

Each alarm is one function of the situation (`Situation`), listed in order of urgency in `_RUNNING_CHECKS` and
`_ENDED_CHECKS`; it returns None where there is no reason for an alarm."""

from collections.abc import Callable
from dataclasses import dataclass, replace

from protocols.trial import Phase, Trial, TrialStatus
from study.session.facts.log_time import Moment, elapsed_s, seconds_between
from study.session.facts.void_reasons import HARDLY_ARRIVED, is_computer_busy
from study.session.watching.followed_session import FollowedSession
from study.session.watching.live import Live
from study.session.watching.watch_view import RUNNING_STATUSES, Alarm, DriftLine, Exposure, SittingStatus

SILENT_AFTER_S = 3.0
"""Age of the live state (s) from which it is out of date. `live.json` is written about four times a second; a slow disk
may delay it by a second or two."""
_LIVELY = ("demo", "waiting for the handle", "rest", "probe", "reference")
"""Activities during which the session writes `live.json` continuously; it does not while a form or a notice is read."""
HANDLE_AWAY_S = 2.0
"""Time for which the handle may be away from its place before that is an alarm (s)."""
UNANSWERED_S = 60.0
"""Time without an answer (s) after which the participant may need help; answers usually take seconds."""
JUST_NOW_S = 60.0
"""Time for which the end of a sitting is reported (s)."""
CATCH_TRIALS, LAPSES = 5, 2
"""Alarm at `LAPSES` wrong answers among the last `CATCH_TRIALS` catch trials, which an attentive participant answers
correctly, because they are at full level."""
PRESENTATIONS, VOIDS = 10, 3
"""Alarm at `VOIDS` void trials among the last `PRESENTATIONS` presentations."""
WARNING_SHARE = 0.8
"""Fraction of a limit (time, dose) at which the experimenter is warned."""


@dataclass(frozen=True, slots=True)
class Situation:
    """All that alarms depend on, at one moment."""

    watched: FollowedSession
    live: Live | None
    problem: str
    """Why the log cannot be followed; empty where it can."""
    standing: SittingStatus
    exposure: Exposure
    now_utc: str
    """Present time, ISO 8601."""
    drifts: tuple[DriftLine, ...] = ()
    """Changes of device or grip that the probes showed."""

    @property
    def trials(self) -> tuple[Trial, ...]:
        """All presentations of the session so far; the last may be open."""
        return self.watched.state.trials

    @property
    def is_live_fresh(self) -> bool:
        """Whether the live state is up to date."""
        return self.live is not None and self.seconds_since(self.live.utc) <= SILENT_AFTER_S

    @property
    def open_s(self) -> float:
        """How long the open trial has waited for its answer (s), by the session's monotonic clock if the live state has
        it; 0 without an open trial."""
        state = self.watched.state
        if state.presented is None or state.answered is not None:
            return 0.0
        presented_at = Moment(state.presented.utc, state.presented.monotonic_s)
        stamped = self.live is not None and self.live.monotonic_s is not None and presented_at.monotonic_s is not None
        if self.live is not None and stamped:
            return elapsed_s(presented_at, Moment(self.live.utc, self.live.monotonic_s))
        return elapsed_s(presented_at, Moment(self.now_utc))

    def seconds_since(self, utc: str) -> float:
        """Seconds from this UTC time (ISO 8601) to now; negative for a later one."""
        return seconds_between(utc, self.now_utc)


def find_alarms(situation: Situation, previous_alarms: tuple[Alarm, ...]) -> tuple[Alarm, ...]:
    """Current alarms, most urgent first. A lasting alarm keeps its start time."""
    previous_by_kind = {alarm.kind: alarm for alarm in previous_alarms}
    checks = _RUNNING_CHECKS if situation.standing in RUNNING_STATUSES else _ENDED_CHECKS
    current_alarms = [alarm for check in checks if (alarm := check(situation)) is not None]
    dated_alarms = [
        alarm
        if alarm.event or alarm.kind not in previous_by_kind
        else replace(alarm, since=previous_by_kind[alarm.kind].since)
        for alarm in current_alarms
    ]
    # The end of a sitting is reported for a limited time, and permanently to a viewer who saw it happen.
    return tuple(
        a
        for a in dated_alarms
        if a.kind not in _ENDS or a.kind in previous_by_kind or situation.seconds_since(a.since) < JUST_NOW_S
    )


def _silence_alarm(situation: Situation) -> Alarm | None:
    """The session should be active, but its live state is not updated."""
    live, text = (
        situation.live,
        "The session has been silent for seconds: it hangs, or was killed. Hands off the handle.",
    )
    if live is None or situation.is_live_fresh:
        return None
    expected = live.activity in _LIVELY or (live.activity == "trial" and situation.watched.state.presented is not None)
    return Alarm("silent", text, live.utc) if expected else None


def _gone_alarm(situation: Situation) -> Alarm | None:
    """The program ended without logging the end of the sitting."""
    if situation.standing != "not running":
        return None
    last_utc = max(situation.watched.last_utc, situation.live.utc if situation.live is not None else "")
    return Alarm("gone", "The program that ran the session is gone. hapteq resume continues the session.", last_utc)


def _end_alarm(situation: Situation) -> Alarm | None:
    """The sitting was ended."""
    watched = situation.watched
    return Alarm("ended", f"The sitting ended: {watched.end_reason}.", watched.last_utc) if watched.end_reason else None


def _log_alarm(situation: Situation) -> Alarm | None:
    """The log cannot be followed any further."""
    if not situation.problem:
        return None
    return Alarm("log", f"The log cannot be followed: {situation.problem}", situation.now_utc)


def _device_alarm(situation: Situation) -> Alarm | None:
    """The device reports a fault."""
    if situation.live is None or not situation.is_live_fresh or not situation.live.fault:
        return None
    return Alarm("device", f"The device reported a fault: {situation.live.fault}.", situation.live.utc)


def _sensor_alarm(situation: Situation) -> Alarm | None:
    """The accelerometer is at the limit of its range."""
    if situation.live is None or not situation.is_live_fresh or not situation.live.sensor_clipped:
        return None
    return Alarm("sensor", "The acceleration sensor is clipped: it reads too little.", situation.now_utc)


def _handle_alarm(situation: Situation) -> Alarm | None:
    """The handle is outside the gate: for longer than `HANDLE_AWAY_S` before a trial, or at any time during a trial."""
    live, radius = situation.live, situation.watched.state.protocol.gate.radius_mm
    if live is None or not situation.is_live_fresh:
        return None
    waiting = live.activity == "waiting for the handle"
    if waiting and not live.handle_ready and situation.seconds_since(live.since_utc) > HANDLE_AWAY_S:
        return Alarm("handle", "The handle is out of its place: no trial starts until it is back.", live.since_utc)
    if live.activity == "trial" and radius > 0 and live.offset_mm is not None and live.offset_mm > radius:
        return Alarm("handle", "The handle is out of its place while a trial runs.", situation.now_utc)
    return None


def _adverse_alarm(situation: Situation) -> Alarm | None:
    """The latest adverse event of this sitting."""
    adverse = [note for note in situation.watched.notes[situation.watched.notes_before :] if note.adverse]
    return Alarm("adverse", f"Adverse event: {adverse[-1].text}", adverse[-1].utc, event=True) if adverse else None


def _time_alarm(situation: Situation) -> Alarm | None:
    """The time limit of the sitting is reached, or near (`WARNING_SHARE`)."""
    share, limit = situation.exposure.time_share, f"the {situation.exposure.limit_min:g} minutes of a sitting"
    if share >= 1:
        return Alarm(
            "time reached", f"{limit[0].upper()}{limit[1:]} are over: it ends after this trial.", situation.now_utc
        )
    return (
        Alarm("time near", f"{share:.0%} of {limit} are over.", situation.now_utc, urgent=False)
        if share >= WARNING_SHARE
        else None
    )


def _dose_alarm(situation: Situation) -> Alarm | None:
    """The vibration dose A(8) reached its limit, or is near it (`WARNING_SHARE`)."""
    share = situation.exposure.dose_share
    if share >= 1:
        return Alarm(
            "dose reached", "The vibration dose is reached: the sitting ends after this trial.", situation.now_utc
        )
    text = f"{share:.0%} of the vibration dose is reached."
    return Alarm("dose near", text, situation.now_utc, urgent=False) if share >= WARNING_SHARE else None


def _lapse_alarm(situation: Situation) -> Alarm | None:
    """Several of the latest catch trials were answered wrongly."""
    last = [trial for trial in situation.trials if trial.phase is Phase.CATCH and trial.counts][-CATCH_TRIALS:]
    wrong = sum(not trial.correct for trial in last)
    if wrong < LAPSES:
        return None
    text = f"{wrong} of the last {len(last)} catch trials were wrong: is the participant tired, or the grip off?"
    return Alarm("lapses", text, situation.watched.last_utc)


def _void_alarm(situation: Situation) -> Alarm | None:
    """Several of the latest presentations were void."""
    last = [trial for trial in situation.trials if trial.status is not TrialStatus.OPEN][-PRESENTATIONS:]
    void = sum(trial.status is TrialStatus.SPOILED for trial in last)
    if void < VOIDS:
        return None
    text = f"{void} of the last {len(last)} presentations were void, the last because {_last_void(situation)}."
    return Alarm("voids", text, situation.watched.last_utc)


def _load_alarm(situation: Situation) -> Alarm | None:
    """Some of the latest presentations were void because the computer was too busy."""
    remarks = situation.watched.remarks[-PRESENTATIONS:]
    void = sum(map(is_computer_busy, remarks))
    if not void:
        return None
    void_text = f"{void} of the last {len(remarks)} presentations {'was' if void == 1 else 'were'} void because of it"
    return Alarm("busy", f"The computer is too busy: {void_text}. Close other programs.", situation.watched.last_utc)


def _still_alarm(situation: Situation) -> Alarm | None:
    """In some of the latest presentations the handle moved less than with any hand (`HARDLY_ARRIVED`)."""
    remarks = situation.watched.remarks[-PRESENTATIONS:]
    still_count = sum(HARDLY_ARRIVED in remark for remark in remarks)
    if not still_count:
        return None
    text = f"In {still_count} of the last {len(remarks)} presentations {HARDLY_ARRIVED}"
    advice = "Pause, and look at motors, handle and accelerometer."
    return Alarm("still", f"{text}. {advice}", situation.watched.last_utc)


def _drift_alarm(situation: Situation) -> Alarm | None:
    """Device or grip changed by more than the analysis of the session allows."""
    exceeding = [drift.sentence for drift in situation.drifts if drift.beyond]
    if not exceeding:
        return None
    text = (
        f"Device or grip has changed by more than the analysis allows: {'; '.join(exceeding)}. Pause, and look at both."
    )
    return Alarm("drift", text, situation.watched.last_utc)


def _last_void(situation: Situation) -> str:
    """Reason of the latest void trial; at least one must exist."""
    remarks = zip(situation.trials, situation.watched.remarks, strict=True)
    return [remark for trial, remark in remarks if trial.status is TrialStatus.SPOILED][-1]


def _answer_alarm(situation: Situation) -> Alarm | None:
    """The open trial has had no answer for longer than `UNANSWERED_S`."""
    state = situation.watched.state
    if situation.standing != "running" or state.presented is None or state.answered is not None:
        return None
    if situation.open_s <= UNANSWERED_S:
        return None
    text = "Nothing was answered for more than a minute: is the participant all right?"
    return Alarm("unanswered", text, state.presented.utc, urgent=False)


_ENDS = ("gone", "ended")
"""Kinds of alarms about the end of a sitting: shown for `JUST_NOW_S`, and permanently to a viewer who saw the end."""
_ENDED_CHECKS: tuple[Callable[[Situation], Alarm | None], ...] = (_log_alarm, _gone_alarm, _end_alarm)
"""Alarms of a session that does not run, most urgent first."""
_RUNNING_CHECKS: tuple[Callable[[Situation], Alarm | None], ...] = (
    _device_alarm, _silence_alarm, _log_alarm, _adverse_alarm, _handle_alarm, _sensor_alarm, _dose_alarm,
    _time_alarm, _still_alarm, _lapse_alarm, _drift_alarm, _load_alarm, _void_alarm, _answer_alarm,
)  # fmt: skip
"""Alarms of a running session, most urgent first."""
