"""Common part of the commands `hapteq study` and `hapteq resume` without the app: in line mode for a person, or with a
simulated participant. Provides the participant, runs the sitting, and prints the results.
"""

import hashlib
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import typer

from protocols.wording.words import Words
from study.cli.motion_notice import announce_motion
from study.cli.progress import show_run_and_trial
from study.cli.results import print_results
from study.devices.clock import Clock, RealClock, VirtualClock
from study.devices.opening import REAL_DEVICES, needs_real_time
from study.errors import WrongUseError
from study.session.views.forms import make_words
from study.store.disk.privacy import format_data_folder_warning
from study.store.sessions.archive import check_subject, find_session
from study.tui.keys.answer_keys import DIGITS, AnswerKeys
from study.tui.line_mode.line_input import LineInput
from study.tui.line_mode.plain_display import PlainDisplay
from study.workflows.results.fold_session import fold_session
from study.workflows.session.conduct_session import Participant, conduct_new, conduct_resumed
from study.workflows.session.end_sitting import end_sitting, write_missing_results
from study.workflows.session.plan_sitting import plan_sitting
from study.workflows.session.simulated_participant import make_simulated_participant
from study.workflows.trial.display import HumanHand
from study.workflows.trial.requests_port import QueuedRequests

LONGEST_NAME = 15
"""Letters and digits of a simulated participant's name that fit into a participant code, which has 16 at most."""


@dataclass(frozen=True, slots=True)
class SittingOptions:
    """Participant and options of a sitting."""

    observer: str | None
    """Name of the simulated participant; None for a person."""
    subject: str | None
    """Participant code; None: asked at the terminal, or made from the name of the simulated participant."""
    keys: AnswerKeys = DIGITS
    """Keys with which a person answers."""
    hands_off: bool = False
    """Whether the caller declares, without a terminal to confirm it, that no hand is on a real device's handle."""


def run_new_session(
    options: SittingOptions,
    protocol_name: str,
    device: str,
    data: Path,
    seed: int | None,
    as_json: bool,
    model: Path | None = None,
) -> None:
    """Run a new session in line mode or simulated, and print its results. protocol_name: name or path of the protocol;
    device: name of the device (`study.devices.opening`); data: data folder; seed: None for a random one; as_json: print
    JSON instead of text; model: file of a fitted model of the device, None without one. Raises StudyError."""
    plan = plan_sitting(protocol_name, options.subject or _ask_subject(options), options.observer, seed, data, model)
    for note in plan.notes:
        typer.echo(f"Note: {note}", err=True)
    _confirm_free_handle(options.observer, device, options.hands_off)
    in_real_time = options.observer is None or needs_real_time(device)
    clock: Clock = RealClock() if in_real_time else VirtualClock()
    with _provide_participant(
        options.observer, plan.session.seed, options.keys, clock, make_words(plan.session.protocol)
    ) as participant:
        sitting_end = conduct_new(plan.session, device, participant)
    print_results(end_sitting(sitting_end, RealClock().utc()), as_json)


def _confirm_free_handle(observer: str | None, device: str, hands_off: bool) -> None:
    """Print a notice that a real device will move by itself, and require its confirmation, where a simulated
    participant (`observer`) uses one; do nothing otherwise. Raises WrongUseError and KeyboardInterrupt
    where `announce_motion` does."""
    if observer is not None and device in REAL_DEVICES:
        announce_motion(
            f"A simulated participant ('{observer}') takes this session: the {device} moves by itself, for as long as "
            "a session lasts. No person may hold the handle, and its workspace must be free.",
            hands_off,
        )


def run_resumed_session(
    session: str, device: str, data: Path, as_json: bool, keys: AnswerKeys = DIGITS, hands_off: bool = False
) -> None:
    """Resume a session in line mode or simulated, and print its results; of a closed session, only write the results
    that are missing and print them. session: name or path of the session; device, data, as_json: as for
    `run_new_session`; keys, hands_off: as in `SittingOptions`. Raises StudyError."""
    folder = find_session(session, data)
    if warning := format_data_folder_warning(folder.path.parent):
        typer.echo(f"Note: {warning}", err=True)
    folded_session = fold_session(folder)
    state, session_opened = folded_session.state, folded_session.state.opened
    if state.closed:
        print_results(write_missing_results(folder, folded_session), as_json)
        return
    _confirm_free_handle(session_opened.observer, device, hands_off)
    in_real_time = session_opened.observer is None or needs_real_time(device)
    clock: Clock = RealClock() if in_real_time else VirtualClock.resume_at(state.sitting.last_moment.utc)
    with _provide_participant(
        session_opened.observer, session_opened.seed, keys, clock, make_words(state.protocol)
    ) as participant:
        sitting_end = conduct_resumed(folder, device, participant)
    print_results(end_sitting(sitting_end, RealClock().utc()), as_json)


@contextmanager
def _provide_participant(
    observer: str | None, seed: int, keys: AnswerKeys, clock: Clock, words: Words
) -> Iterator[Participant]:
    """Context manager that yields the participant of a sitting: simulated, or a person in line mode (`observer` is
    None). A person is asked to wait before the sitting, and told after it that the results are for the experimenter.
    Raises WrongUseError for a person where standard input is closed."""
    if observer is not None:
        with show_run_and_trial(f"simulated participant '{observer}'") as show_question:
            yield make_simulated_participant(observer, seed, clock, on_question=show_question)
        return
    typer.echo(words["preparing_device"], err=True)
    if sys.stdin is None:
        raise WrongUseError(
            "There is nothing to read answers from",
            "Standard input is closed.",
            "Start hapteq in a terminal, or with answers from a pipe.",
        )
    requests = QueuedRequests()
    display = PlainDisplay(LineInput(), sys.stdout, clock, keys, requests.send, words)
    yield Participant(display=display, hand=HumanHand(), clock=clock, requests=requests)
    # Results are not for the participant, who may still sit there.
    typer.echo(f"\n{words['for_experimenter']}", err=True)


def make_simulated_code(observer: str) -> str:
    """Make the participant code of a simulated participant: the ASCII letters and digits of its name, then "1". Of more
    than `LONGEST_NAME` the first 9 are used, and 6 digits of the SHA-256 of all, so that long names differ. Hyphens and
    underscores do not count, as in `find_observer`."""
    letters = "".join(character for character in observer if character.isascii() and character.isalnum())
    is_short = len(letters) <= LONGEST_NAME
    return (letters if is_short else letters[:9] + hashlib.sha256(letters.encode()).hexdigest()[:6]) + "1"


def _ask_subject(options: SittingOptions) -> str:
    """Return the participant code: made for a simulated participant, else asked at the terminal until it is valid.
    Raises WrongUseError for a person without a terminal."""
    if options.observer is not None:
        return make_simulated_code(options.observer)
    if sys.stdin is None or not sys.stdin.isatty():
        raise WrongUseError(
            "Whose answers are these?",
            "There is no terminal to ask for the participant's code.",
            "Give it with --subject, such as --subject P01.",
        )
    while True:
        code = str(typer.prompt("Participant code (letters and digits, such as P01)"))
        try:
            return check_subject(code)
        except WrongUseError as error:
            typer.echo(f"{error.happened} {error.do_now}", err=True)
