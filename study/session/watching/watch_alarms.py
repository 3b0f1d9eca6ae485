"""Alarms for the experimenter who follows a session (`find_alarms`): faults of device, sensor, computer or program,
limits that are reached, trials that go wrong, and adverse events.

Each check is a function of the situation (`Situation`), listed in order of urgency in `_RUNNING_CHECKS` and
`_ENDED_CHECKS`; it returns one alarm, or None where there is no reason for one."""

from collections.abc import Callable
from dataclasses import dataclass, replace

from protocols.trial import Phase, Trial, TrialStatus
from study.session.facts.log_time import Moment, compute_elapsed_s, compute_wall_clock_s
from study.session.facts.void_reasons import TOO_LITTLE_MOTION, is_computer_busy
from study.session.watching.followed_session import FollowedSession
from study.session.watching.live_state import LiveState
from study.session.watching.watch_view import RUNNING_STATUSES, Alarm, DriftRecord, Exposure, SittingStatus

LIVE_TIMEOUT_S = 3.0
"""Age of the live state (s) above which it is out of date. Chosen: `live.json` is written about four times a second,
and a slow disk may delay it by a second or two."""
_LIVE_ACTIVITIES = ("demo", "waiting for the handle", "rest", "probe", "reference")
"""Activities, besides an open trial, in which `live.json` is written continuously; it is not while a form is read."""
HANDLE_AWAY_LIMIT_S = 2.0
"""Time (s) outside the gate before a trial above which there is an alarm. Chosen: short excursions raise none."""
ANSWER_ALARM_S = 60.0
"""Time without an answer (s) above which there is an alarm, because the participant may need help. Chosen: answers
usually take seconds."""
END_REPORTED_S = 60.0
"""Time (s) for which the end of a sitting is reported to a viewer who began to watch after it. Chosen."""
CATCH_TRIAL_WINDOW, LAPSE_LIMIT = 5, 2
"""Alarm at `LAPSE_LIMIT` wrong answers among the last `CATCH_TRIAL_WINDOW` catch trials, which an attentive participant
answers correctly, because they are at full level. Chosen: a single lapse raises no alarm."""
TRIAL_WINDOW, VOID_LIMIT = 10, 3
"""Alarm at `VOID_LIMIT` void trials among the last `TRIAL_WINDOW` presentations. Chosen: single ones raise none."""
WARNING_FRACTION = 0.8
"""Fraction of a limit (time, dose) from which the experimenter is warned. Chosen: its last fifth."""


@dataclass(frozen=True, slots=True)
class Situation:
    """State of a followed session at one time, from which all alarms are decided."""

    session: FollowedSession
    live: LiveState | None
    problem: str
    """Why the log cannot be followed; empty where it can."""
    standing: SittingStatus
    exposure: Exposure
    now_utc: str
    """Present time, ISO 8601."""
    drifts: tuple[DriftRecord, ...] = ()
    """Changes of device or grip, measured by the probes."""

    @property
    def trials(self) -> tuple[Trial, ...]:
        """All presentations of the session so far; the last may be open."""
        return self.session.state.trials

    @property
    def is_live_fresh(self) -> bool:
        """Whether the live state is up to date."""
        return self.live is not None and self.compute_seconds_since(self.live.utc) <= LIVE_TIMEOUT_S

    @property
    def open_s(self) -> float:
        """How long the open trial has waited for its answer (s), by the session's monotonic clock if the live state has
        it; 0 without an open trial."""
        state = self.session.state
        if state.presented is None or state.answered is not None:
            return 0.0
        presentation_moment = Moment(state.presented.utc, state.presented.monotonic_s)
        has_monotonic_time = (
            self.live is not None and self.live.monotonic_s is not None and presentation_moment.monotonic_s is not None
        )
        if self.live is not None and has_monotonic_time:
            return compute_elapsed_s(presentation_moment, Moment(self.live.utc, self.live.monotonic_s))
        return compute_elapsed_s(presentation_moment, Moment(self.now_utc))

    def compute_seconds_since(self, utc: str) -> float:
        """Compute the seconds from this UTC time (ISO 8601) to `now_utc`; negative for a later one."""
        return compute_wall_clock_s(utc, self.now_utc)


def find_alarms(situation: Situation, previous_alarms: tuple[Alarm, ...]) -> tuple[Alarm, ...]:
    """Evaluate all checks. Returns the current alarms, most urgent first; a lasting alarm that was among
    `previous_alarms` keeps its start time. The end of a sitting is reported for `END_REPORTED_S`, and permanently to a
    viewer who saw it."""
    previous_by_kind = {alarm.kind: alarm for alarm in previous_alarms}
    checks = _RUNNING_CHECKS if situation.standing in RUNNING_STATUSES else _ENDED_CHECKS
    current_alarms = [alarm for check in checks if (alarm := check(situation)) is not None]
    dated_alarms = [
        alarm
        if alarm.event or alarm.kind not in previous_by_kind
        else replace(alarm, since=previous_by_kind[alarm.kind].since)
        for alarm in current_alarms
    ]
    return tuple(
        dated_alarm
        for dated_alarm in dated_alarms
        if dated_alarm.kind not in _END_KINDS
        or dated_alarm.kind in previous_by_kind
        or situation.compute_seconds_since(dated_alarm.since) < END_REPORTED_S
    )


def _check_live_state(situation: Situation) -> Alarm | None:
    """Alarm where the live state is out of date during an activity that updates it continuously."""
    live, text = (
        situation.live,
        "The session has been silent for seconds: it hangs, or was killed. Hands off the handle.",
    )
    if live is None or situation.is_live_fresh:
        return None
    is_updated = live.activity in _LIVE_ACTIVITIES or (
        live.activity == "trial" and situation.session.state.presented is not None
    )
    return Alarm("silent", text, live.utc) if is_updated else None


def _check_program_ended(situation: Situation) -> Alarm | None:
    """Alarm where the program ended without logging the end of the sitting (status "not running")."""
    if situation.standing != "not running":
        return None
    last_utc = max(situation.session.last_utc, situation.live.utc if situation.live is not None else "")
    return Alarm("gone", "The program that ran the session is gone. hapteq resume continues the session.", last_utc)


def _check_sitting_ended(situation: Situation) -> Alarm | None:
    """Alarm where the end of the sitting was logged, with its reason."""
    session = situation.session
    return Alarm("ended", f"The sitting ended: {session.end_reason}.", session.last_utc) if session.end_reason else None


def _check_log(situation: Situation) -> Alarm | None:
    """Alarm where the log cannot be read any further."""
    if not situation.problem:
        return None
    return Alarm("log", f"The log cannot be followed: {situation.problem}", situation.now_utc)


def _check_device(situation: Situation) -> Alarm | None:
    """Alarm where the device reports a fault."""
    if situation.live is None or not situation.is_live_fresh or not situation.live.fault:
        return None
    return Alarm("device", f"The device reported a fault: {situation.live.fault}.", situation.live.utc)


def _check_sensor(situation: Situation) -> Alarm | None:
    """Alarm where the accelerometer is at the limit of its range."""
    if situation.live is None or not situation.is_live_fresh or not situation.live.sensor_clipped:
        return None
    return Alarm("sensor", "The acceleration sensor is clipped: it reads too little.", situation.now_utc)


def _check_handle(situation: Situation) -> Alarm | None:
    """Alarm where the handle is outside the gate: longer than `HANDLE_AWAY_LIMIT_S` before a trial, or during one."""
    live, radius_mm = situation.live, situation.session.state.protocol.gate.radius_mm
    if live is None or not situation.is_live_fresh:
        return None
    is_waiting = live.activity == "waiting for the handle"
    if is_waiting and not live.handle_ready and situation.compute_seconds_since(live.since_utc) > HANDLE_AWAY_LIMIT_S:
        return Alarm("handle", "The handle is out of its place: no trial starts until it is back.", live.since_utc)
    if live.activity == "trial" and radius_mm > 0 and live.offset_mm is not None and live.offset_mm > radius_mm:
        return Alarm("handle", "The handle is out of its place while a trial runs.", situation.now_utc)
    return None


def _check_adverse_events(situation: Situation) -> Alarm | None:
    """Alarm with the latest adverse event of this sitting."""
    adverse_notes = [note for note in situation.session.notes[situation.session.notes_before :] if note.adverse]
    return (
        Alarm("adverse", f"Adverse event: {adverse_notes[-1].text}", adverse_notes[-1].utc, event=True)
        if adverse_notes
        else None
    )


def _check_time_limit(situation: Situation) -> Alarm | None:
    """Alarm where the time limit of the sitting is reached, or near (`WARNING_FRACTION`)."""
    limit_fraction, limit_text = (
        situation.exposure.time_share,
        f"the {situation.exposure.limit_min:g} minutes of a sitting",
    )
    if limit_fraction >= 1:
        return Alarm(
            "time reached",
            f"{limit_text[0].upper()}{limit_text[1:]} are over: it ends after this trial.",
            situation.now_utc,
        )
    return (
        Alarm("time near", f"{limit_fraction:.0%} of {limit_text} are over.", situation.now_utc, urgent=False)
        if limit_fraction >= WARNING_FRACTION
        else None
    )


def _check_dose(situation: Situation) -> Alarm | None:
    """Alarm where the vibration dose A(8) reached its limit, or is near it (`WARNING_FRACTION`)."""
    limit_fraction = situation.exposure.dose_share
    if limit_fraction >= 1:
        return Alarm(
            "dose reached", "The vibration dose is reached: the sitting ends after this trial.", situation.now_utc
        )
    text = f"{limit_fraction:.0%} of the vibration dose is reached."
    return Alarm("dose near", text, situation.now_utc, urgent=False) if limit_fraction >= WARNING_FRACTION else None


def _check_catch_trials(situation: Situation) -> Alarm | None:
    """Alarm where at least `LAPSE_LIMIT` of the latest `CATCH_TRIAL_WINDOW` catch trials were answered wrongly."""
    trials = [trial for trial in situation.trials if trial.phase is Phase.CATCH and trial.is_valid][
        -CATCH_TRIAL_WINDOW:
    ]
    lapse_count = sum(not trial.correct for trial in trials)
    if lapse_count < LAPSE_LIMIT:
        return None
    text = (
        f"{lapse_count} of the last {len(trials)} catch trials were wrong: is the participant tired, or the grip off?"
    )
    return Alarm("lapses", text, situation.session.last_utc)


def _check_void_trials(situation: Situation) -> Alarm | None:
    """Alarm where at least `VOID_LIMIT` of the latest `TRIAL_WINDOW` presentations were void."""
    presentations = [trial for trial in situation.trials if trial.status is not TrialStatus.OPEN][-TRIAL_WINDOW:]
    void_count = sum(trial.status is TrialStatus.SPOILED for trial in presentations)
    if void_count < VOID_LIMIT:
        return None
    text = (
        f"{void_count} of the last {len(presentations)} presentations were void, "
        f"the last because {_find_void_reason(situation)}."
    )
    return Alarm("voids", text, situation.session.last_utc)


def _check_computer_load(situation: Situation) -> Alarm | None:
    """Alarm where some of the latest presentations were void because the computer was too busy."""
    remarks = situation.session.remarks[-TRIAL_WINDOW:]
    busy_count = sum(map(is_computer_busy, remarks))
    if not busy_count:
        return None
    void_text = (
        f"{busy_count} of the last {len(remarks)} presentations {'was' if busy_count == 1 else 'were'} "
        "void because of it"
    )
    return Alarm("busy", f"The computer is too busy: {void_text}. Close other programs.", situation.session.last_utc)


def _check_handle_motion(situation: Situation) -> Alarm | None:
    """Alarm where some of the latest presentations have the remark `TOO_LITTLE_MOTION` (less motion than any hand)."""
    remarks = situation.session.remarks[-TRIAL_WINDOW:]
    still_count = sum(TOO_LITTLE_MOTION in remark for remark in remarks)
    if not still_count:
        return None
    text = f"In {still_count} of the last {len(remarks)} presentations {TOO_LITTLE_MOTION}"
    advice = "Pause, and look at motors, handle and accelerometer."
    return Alarm("still", f"{text}. {advice}", situation.session.last_utc)


def _check_drift(situation: Situation) -> Alarm | None:
    """Alarm where device or grip changed by more than the analysis of the session allows."""
    drift_sentences = [drift.sentence for drift in situation.drifts if drift.beyond]
    if not drift_sentences:
        return None
    text = (
        f"Device or grip has changed by more than the analysis allows: {'; '.join(drift_sentences)}. "
        "Pause, and look at both."
    )
    return Alarm("drift", text, situation.session.last_utc)


def _find_void_reason(situation: Situation) -> str:
    """Find the reason of the latest void trial; at least one must exist."""
    trials_with_remarks = zip(situation.trials, situation.session.remarks, strict=True)
    return [remark for trial, remark in trials_with_remarks if trial.status is TrialStatus.SPOILED][-1]


def _check_answer_time(situation: Situation) -> Alarm | None:
    """Alarm where the open trial has had no answer for longer than `ANSWER_ALARM_S`."""
    state = situation.session.state
    if situation.standing != "running" or state.presented is None or state.answered is not None:
        return None
    if situation.open_s <= ANSWER_ALARM_S:
        return None
    text = "Nothing was answered for more than a minute: is the participant all right?"
    return Alarm("unanswered", text, state.presented.utc, urgent=False)


_END_KINDS = ("gone", "ended")
"""Kinds of alarms about the end of a sitting, which `find_alarms` reports to a new viewer for a limited time only."""
_ENDED_CHECKS: tuple[Callable[[Situation], Alarm | None], ...] = (
    _check_log,
    _check_program_ended,
    _check_sitting_ended,
)
"""Alarms of a session that does not run, most urgent first."""
_RUNNING_CHECKS: tuple[Callable[[Situation], Alarm | None], ...] = (
    _check_device, _check_live_state, _check_log, _check_adverse_events, _check_handle, _check_sensor, _check_dose,
    _check_time_limit, _check_handle_motion, _check_catch_trials, _check_drift, _check_computer_load,
    _check_void_trials, _check_answer_time,
)  # fmt: skip
"""Alarms of a running session, most urgent first."""
