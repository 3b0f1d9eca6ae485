"""Alarms for the experimenter who follows a session: faults of device, sensor, computer or program, limits that are
reached, trials that go wrong, and adverse events.

Each alarm is one function of the situation (`Situation`), listed in order of urgency in `_RUNNING` and `_OVER`; it
returns None where there is no reason for an alarm.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

from protocols.trial import Phase, Trial, TrialStatus
from study.session.facts.log_time import Moment, elapsed_s, seconds_between
from study.session.facts.void_reasons import HARDLY_ARRIVED, computer_too_busy
from study.session.watching.followed_session import FollowedSession
from study.session.watching.live import Live
from study.session.watching.watch_view import ON, Alarm, DriftLine, Exposure, Standing

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
NEAR = 0.8
"""Fraction of a limit (time, dose) at which the experimenter is warned."""


@dataclass(frozen=True, slots=True)
class Situation:
    """All that alarms depend on, at one moment."""

    watched: FollowedSession
    live: Live | None
    problem: str
    """Why the log cannot be followed; empty where it can."""
    standing: Standing
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
    def fresh(self) -> bool:
        """Whether the live state is up to date."""
        return self.live is not None and self.seconds_since(self.live.utc) <= SILENT_AFTER_S

    @property
    def open_s(self) -> float:
        """How long the open trial has waited for its answer (s), by the session's monotonic clock if the live state has
        it; 0 without an open trial."""
        state = self.watched.state
        if state.presented is None or state.answered is not None:
            return 0.0
        begun = Moment(state.presented.utc, state.presented.monotonic_s)
        stamped = self.live is not None and self.live.monotonic_s is not None and begun.monotonic_s is not None
        if self.live is not None and stamped:
            return elapsed_s(begun, Moment(self.live.utc, self.live.monotonic_s))
        return elapsed_s(begun, Moment(self.now_utc))

    def seconds_since(self, utc: str) -> float:
        """Seconds from this UTC time (ISO 8601) to now; negative for a later one."""
        return seconds_between(utc, self.now_utc)


def alarms_of(now: Situation, before: tuple[Alarm, ...]) -> tuple[Alarm, ...]:
    """Current alarms, most urgent first. A lasting alarm keeps its start time."""
    known = {alarm.kind: alarm for alarm in before}
    checks = _RUNNING if now.standing in ON else _OVER
    found = [alarm for look in checks if (alarm := look(now)) is not None]
    lasting = [
        alarm if alarm.event or alarm.kind not in known else replace(alarm, since=known[alarm.kind].since)
        for alarm in found
    ]
    # The end of a sitting is reported for a limited time, and permanently to a viewer who saw it happen.
    return tuple(
        a for a in lasting if a.kind not in _ENDS or a.kind in known or now.seconds_since(a.since) < JUST_NOW_S
    )


def _silence_alarm(now: Situation) -> Alarm | None:
    """The session should be active, but its live state is not updated."""
    live, silence = now.live, "The session has been silent for seconds: it hangs, or was killed. Hands off the handle."
    if live is None or now.fresh:
        return None
    expected = live.activity in _LIVELY or (live.activity == "trial" and now.watched.state.presented is not None)
    return Alarm("silent", silence, live.utc) if expected else None


def _gone_alarm(now: Situation) -> Alarm | None:
    """The program ended without logging the end of the sitting."""
    if now.standing != "not running":
        return None
    last_utc = max(now.watched.last_utc, now.live.utc if now.live is not None else "")
    return Alarm("gone", "The program that ran the session is gone. hapteq resume continues the session.", last_utc)


def _end_alarm(now: Situation) -> Alarm | None:
    """The sitting was ended."""
    watched = now.watched
    return Alarm("ended", f"The sitting ended: {watched.left}.", watched.last_utc) if watched.left else None


def _log_alarm(now: Situation) -> Alarm | None:
    """The log cannot be followed any further."""
    if not now.problem:
        return None
    return Alarm("log", f"The log cannot be followed: {now.problem}", now.now_utc)


def _device_alarm(now: Situation) -> Alarm | None:
    """The device reports a fault."""
    if now.live is None or not now.fresh or not now.live.fault:
        return None
    return Alarm("device", f"The device reported a fault: {now.live.fault}.", now.live.utc)


def _sensor_alarm(now: Situation) -> Alarm | None:
    """The accelerometer is at the limit of its range."""
    if now.live is None or not now.fresh or not now.live.sensor_clipped:
        return None
    return Alarm("sensor", "The acceleration sensor is clipped: it reads too little.", now.now_utc)


def _handle_alarm(now: Situation) -> Alarm | None:
    """The handle is outside the gate: for longer than `HANDLE_AWAY_S` before a trial, or at any time during a trial."""
    live, radius = now.live, now.watched.state.protocol.gate.radius_mm
    if live is None or not now.fresh:
        return None
    waiting = live.activity == "waiting for the handle"
    if waiting and not live.handle_ready and now.seconds_since(live.since_utc) > HANDLE_AWAY_S:
        return Alarm("handle", "The handle is out of its place: no trial starts until it is back.", live.since_utc)
    if live.activity == "trial" and radius > 0 and live.offset_mm is not None and live.offset_mm > radius:
        return Alarm("handle", "The handle is out of its place while a trial runs.", now.now_utc)
    return None


def _adverse_alarm(now: Situation) -> Alarm | None:
    """The latest adverse event of this sitting."""
    adverse = [note for note in now.watched.notes[now.watched.notes_before :] if note.adverse]
    return Alarm("adverse", f"Adverse event: {adverse[-1].text}", adverse[-1].utc, event=True) if adverse else None


def _time_alarm(now: Situation) -> Alarm | None:
    """The time limit of the sitting is reached, or near (`NEAR`)."""
    share, limit = now.exposure.time_share, f"the {now.exposure.limit_min:g} minutes of a sitting"
    if share >= 1:
        return Alarm("time reached", f"{limit[0].upper()}{limit[1:]} are over: it ends after this trial.", now.now_utc)
    return Alarm("time near", f"{share:.0%} of {limit} are over.", now.now_utc, urgent=False) if share >= NEAR else None


def _dose_alarm(now: Situation) -> Alarm | None:
    """The vibration dose A(8) reached its limit, or is near it (`NEAR`)."""
    share = now.exposure.dose_share
    if share >= 1:
        return Alarm("dose reached", "The vibration dose is reached: the sitting ends after this trial.", now.now_utc)
    near = f"{share:.0%} of the vibration dose is reached."
    return Alarm("dose near", near, now.now_utc, urgent=False) if share >= NEAR else None


def _lapse_alarm(now: Situation) -> Alarm | None:
    """Several of the latest catch trials were answered wrongly."""
    last = [trial for trial in now.trials if trial.phase is Phase.CATCH and trial.counts][-CATCH_TRIALS:]
    wrong = sum(not trial.correct for trial in last)
    if wrong < LAPSES:
        return None
    many = f"{wrong} of the last {len(last)} catch trials were wrong: is the participant tired, or the grip off?"
    return Alarm("lapses", many, now.watched.last_utc)


def _void_alarm(now: Situation) -> Alarm | None:
    """Several of the latest presentations were void."""
    last = [trial for trial in now.trials if trial.status is not TrialStatus.OPEN][-PRESENTATIONS:]
    void = sum(trial.status is TrialStatus.SPOILED for trial in last)
    if void < VOIDS:
        return None
    many = f"{void} of the last {len(last)} presentations were void, the last because {_last_void(now)}."
    return Alarm("voids", many, now.watched.last_utc)


def _load_alarm(now: Situation) -> Alarm | None:
    """Some of the latest presentations were void because the computer was too busy."""
    remarks = now.watched.remarks[-PRESENTATIONS:]
    void = sum(map(computer_too_busy, remarks))
    if not void:
        return None
    many = f"{void} of the last {len(remarks)} presentations {'was' if void == 1 else 'were'} void because of it"
    return Alarm("busy", f"The computer is too busy: {many}. Close other programs.", now.watched.last_utc)


def _still_alarm(now: Situation) -> Alarm | None:
    """In some of the latest presentations the handle moved less than with any hand (`HARDLY_ARRIVED`)."""
    remarks = now.watched.remarks[-PRESENTATIONS:]
    still = sum(HARDLY_ARRIVED in remark for remark in remarks)
    if not still:
        return None
    many = f"In {still} of the last {len(remarks)} presentations {HARDLY_ARRIVED}"
    look = "Pause, and look at motors, handle and accelerometer."
    return Alarm("still", f"{many}. {look}", now.watched.last_utc)


def _drift_alarm(now: Situation) -> Alarm | None:
    """Device or grip changed by more than the analysis of the session allows."""
    beyond = [drift.sentence for drift in now.drifts if drift.beyond]
    if not beyond:
        return None
    left = f"Device or grip has changed by more than the analysis allows: {'; '.join(beyond)}. Pause, and look at both."
    return Alarm("drift", left, now.watched.last_utc)


def _last_void(now: Situation) -> str:
    """Reason of the latest void trial; at least one must exist."""
    remarks = zip(now.trials, now.watched.remarks, strict=True)
    return [remark for trial, remark in remarks if trial.status is TrialStatus.SPOILED][-1]


def _answer_alarm(now: Situation) -> Alarm | None:
    """The open trial has had no answer for longer than `UNANSWERED_S`."""
    state = now.watched.state
    if now.standing != "running" or state.presented is None or state.answered is not None:
        return None
    if now.open_s <= UNANSWERED_S:
        return None
    minute = "Nothing was answered for more than a minute: is the participant all right?"
    return Alarm("unanswered", minute, state.presented.utc, urgent=False)


_ENDS = ("gone", "ended")
"""Kinds of alarms about the end of a sitting: shown for `JUST_NOW_S`, and permanently to a viewer who saw the end."""
_OVER: tuple[Callable[[Situation], Alarm | None], ...] = (_log_alarm, _gone_alarm, _end_alarm)
"""Alarms of a session that does not run, most urgent first."""
_RUNNING: tuple[Callable[[Situation], Alarm | None], ...] = (
    _device_alarm, _silence_alarm, _log_alarm, _adverse_alarm, _handle_alarm, _sensor_alarm, _dose_alarm,
    _time_alarm, _still_alarm, _lapse_alarm, _drift_alarm, _load_alarm, _void_alarm, _answer_alarm,
)  # fmt: skip
"""Alarms of a running session, most urgent first."""
