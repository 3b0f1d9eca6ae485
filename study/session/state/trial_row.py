"""A presentation as the first half of its row in `trials.csv`; answer and measurement come later."""

from protocols.trial import Trial, TrialStatus, VoidCause
from study.session.facts.events import SessionOpened, TrialPresented


def trial_row(opened: SessionOpened, event: TrialPresented, felt: bool | None, repeat_cause: VoidCause | None) -> Trial:
    return Trial(
        subject=opened.subject,
        session=opened.session,
        run=event.run,
        trial=event.trial,
        attempt=event.attempt,
        phase=event.phase,
        frequency_hz=event.frequency_hz,
        level_n=event.level_n,
        direction_shown=event.direction,
        answer=None,
        correct=None,
        reversal=False,
        response_time_s=None,
        delivered_mps2=None,
        off_axis_mps2=None,
        displacement_mm=None,
        missed_ticks=None,
        felt=felt,
        status=TrialStatus.OPEN,
        angle_deg=event.angle_deg,
        wanted_mps2=event.wanted_mps2,
        repeat_cause=repeat_cause,
    )
