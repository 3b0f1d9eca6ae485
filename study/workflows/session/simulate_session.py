"""Simulate one session: a simulated participant on the simulated device, in virtual time (Python interface:
`study.simulate_session`). `rehearse_study` simulates the sessions of a complete study."""

from pathlib import Path

from protocols.definition.study_protocol import StudyProtocol
from study.devices.clock import VirtualClock
from study.errors import StudyError
from study.store.formats.protocol_files import ProtocolFile
from study.store.sessions.archive import SessionFolder
from study.workflows.results.session_results import write_tables
from study.workflows.session.conduct_session import conduct_new
from study.workflows.session.open_session import SessionPlan
from study.workflows.session.simulated_participant import make_simulated_participant


def simulate_session(
    protocol: ProtocolFile[StudyProtocol],
    data: Path | str,
    observer: str = "ideal",
    subject: str = "ideal1",
    seed: int = 1,
    model: Path | str | None = None,
) -> SessionFolder:
    """Run a session in virtual time and write its log and tables below `data`; returns the session folder.

    observer: name of a simulated observer, as for `hapteq study --observer`; subject: participant code of the session;
    model: file of an identified model that equalizes the stimuli. The same seed and participant number give the same
    answers. Raises StudyError where the session cannot be begun or the simulated participant does not finish it.
    """
    plan = SessionPlan(
        protocol=protocol.protocol,
        protocol_text=protocol.text,
        protocol_locked=protocol.locked,
        subject=subject,
        observer=observer,
        seed=seed,
        data_folder=Path(data),
        model=None if model is None else Path(model),
    )
    conducted = conduct_new(plan, "simulated", make_simulated_participant(observer, seed, VirtualClock()))
    write_tables(conducted.folder)
    if conducted.end_reason:
        raise StudyError(
            "The simulated participant did not finish",
            f"{conducted.folder.name}: {conducted.end_reason}.",
            "Change what stops it in the protocol, and simulate another session.",
            saved="Everything until then is in the folder.",
        )
    return conducted.folder
