"""A view of a session and where it comes from."""

from dataclasses import replace

from study.session.watching.live_state import LiveState
from study.session.watching.watch_view import (
    Alarm,
    ClosedTrial,
    Exposure,
    FormRecord,
    NoteRecord,
    OpenTrial,
    PracticeResult,
    StaircasePoint,
    WatchedRun,
    WatchView,
)

UTC = "2026-11-22T10:17:00.000+00:00"
LIVE = LiveState(UTC, "trial", UTC, "", 1.2, True, 3.3, False, 0)
LEVELS = (1.0, 1.0, 1.0, 0.631, 1.0, 1.0, 1.0, 0.631, 0.631, 0.631, 0.398, 0.631, 0.631)
CORRECT = (True, True, True, False, True, True, True, True, True, True, False, True, True)
TURNS = {3: True, 6: True, 10: True}
POINTS = tuple(
    StaircasePoint(i, n, c, TURNS.get(i, False)) for i, (n, c) in enumerate(zip(LEVELS, CORRECT, strict=True))
)


def row(trial: int, **changes) -> ClosedTrial:
    point = POINTS[trial]
    plain = ClosedTrial(
        run=5, trial=trial, attempt=0, phase="test", frequency_hz=25.0, level_n=point.level_n,
        shown=1 + trial % 2, answer=1 + trial % 2 if point.correct else 2 - trial % 2, correct=point.correct,
        reversal=point.reversal, response_time_s=2.1, delivered_mps2=4.04, off_axis_mps2=0.8, status="ok", remark="",
    )  # fmt: skip
    return replace(plain, **changes)


def view(**changes) -> WatchView:
    runs = (
        WatchedRun(0, "training", 5.0, "done", 13, 13, 43),
        *(WatchedRun(1 + i, "practice", f, "done", 0, 0, 5) for i, f in enumerate((15.0, 25.0, 35.0, 45.0))),
        WatchedRun(5, "test", 25.0, "present", 3, 13, 13),
        *(WatchedRun(6 + i, "test", f, "to come", 0, 13, 0) for i, f in enumerate((35.0, 5.0, 15.0, 45.0))),
    )
    void = row(12, attempt=0, shown=None, answer=None, correct=None, status="spoiled", remark="the handle was let go")
    lapse = row(9, phase="catch", level_n=3.0, answer=1, correct=False)
    flagged = row(8, status="flagged", remark="leaning on the spring")
    rows = (row(12, attempt=1), void, row(11), row(10), lapse, flagged, *(row(i) for i in range(7, -1, -1)))
    plain = WatchView(
        utc=UTC, session="P01_001", subject="P01", protocol="Force thresholds for telling two directions apart",
        device="omega.3 (serial 1)", simulated=False, observer=None, standing="running", reason="",
        activity="waiting for the answer", activity_s=4.2, runs=runs, shown_run=5, points=POINTS, next_level_n=0.631,
        cap_n=3.0, open_trial=OpenTrial(5, 13, 0, 25.0, 0.631, False, 4.2), last=rows, answers=76,
        exposure=Exposure(31.4, 120.0, 0.43, 2.5), catch_given=1, catch_lapses=1,
        practice=(PracticeResult(15.0, 4, 5, True), PracticeResult(45.0, 3, 5, False)),
        forms=(FormRecord("2026-11-22T09:40:00.000+00:00", "consent", True),),
        notes=(NoteRecord("2026-11-22T10:01:00.000+00:00", "experimenter", "Asks for a lower chair", False),),
        gate_radius_mm=10.0, live=LIVE, alarms=(),
    )  # fmt: skip
    return replace(plain, **changes)


ALARM = Alarm("sensor", "The acceleration sensor is clipped: it reads too little.", UTC)


class Source:
    def __init__(self, first: WatchView | None) -> None:
        self.view = first
        self.problem = ""

    def latest(self) -> WatchView | None:
        return self.view
