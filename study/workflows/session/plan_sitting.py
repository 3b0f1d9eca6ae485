"""From what somebody asks for to a plan: the protocol read, the code checked, the seed drawn."""

from dataclasses import dataclass
from pathlib import Path

from study.store.disk.privacy import left_open
from study.store.formats.protocol_files import read_study_protocol
from study.store.sessions.archive import check_subject
from study.workflows.session.equalize_stimuli import check_playable
from study.workflows.session.open_session import SessionPlan, fresh_seed
from study.workflows.session.participant_code import check_code, unfinished_sessions


@dataclass(frozen=True, slots=True)
class SittingPlan:
    session: SessionPlan
    notes: tuple[str, ...]
    """Worth knowing before anybody begins."""


def plan_sitting(
    protocol_name: str, subject: str, observer: str | None, seed: int | None, data: Path, model: Path | None = None
) -> SittingPlan:
    """observer: name of a simulated participant; None for a person. Raises StudyError where it cannot be begun."""
    source = read_study_protocol(protocol_name, data)
    plan = SessionPlan(
        protocol=source.protocol,
        protocol_text=source.text,
        protocol_locked=source.locked,
        subject=check_subject(subject),
        observer=observer,
        seed=fresh_seed() if seed is None else seed,
        data=data,
        model=model,
    )
    check_playable(plan.protocol, model)
    check_code(data, plan.subject, simulated=observer is not None)
    unfinished_before = (
        f"{unfinished.name} is not finished; hapteq resume {unfinished.path} goes on with it."
        for unfinished in unfinished_sessions(data, plan.subject, source.protocol.name)
    )
    return SittingPlan(plan, (*unfinished_before, *filter(None, [left_open(data)])))
