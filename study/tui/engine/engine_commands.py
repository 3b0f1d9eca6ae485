"""Commands of the screen, as the engine performs them one after another.

They are: lists and views of sessions and diagnoses, whole sittings, analyses, diagnoses, withdrawals, the calibration
of the accelerometer, and requests to sessions of other programs (`EngineCommands.perform`). Results and progress are
sent to the screen as messages of `from_engine`.
"""

import contextlib
import itertools
import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

from protocols.wording.words import Words
from study.devices.clock import RealClock
from study.devices.device import Device
from study.devices.opening import (
    REAL_DEVICES,
    calibrate_accelerometer,
    get_lab_file_path,
    save_accelerometer_calibration,
)
from study.errors import StudyError, WrongUseError
from study.local_clock import convert_to_machine_zone
from study.session.facts.events import DeviceFacts
from study.session.views.archive_views import HomeView
from study.session.views.forms import make_words
from study.session.views.resume_command import find_device_option, format_logged_resume_command
from study.store.disk.privacy import format_data_folder_warning
from study.store.sessions.archive import SessionFolder, find_session
from study.tui.engine.from_engine import (
    CalibrationComputed,
    CalibrationStored,
    DiagnosisContent,
    DiagnosisProgress,
    Finished,
    HomeContent,
    ParticipantWords,
    PlacementRequest,
    PreparationStarted,
    Results,
    SessionContent,
    SessionReady,
    UserNotice,
    Withdrawn,
)
from study.tui.engine.remote_display import RemoteDisplay
from study.tui.engine.screen_link import ScreenLink
from study.tui.engine.to_engine import (
    Analyze,
    BeginSession,
    CalibrateSensor,
    Command,
    Diagnose,
    Resume,
    SendRequest,
    SessionOrder,
    ShowDiagnosis,
    ShowHome,
    ShowSession,
    StoreCalibration,
    Withdraw,
)
from study.workflows.results.fold_session import fold_session
from study.workflows.results.write_results import write_results
from study.workflows.results.written_analysis import WrittenAnalysis
from study.workflows.session.conduct_session import ConductedSitting, Participant, conduct_new, conduct_resumed
from study.workflows.session.end_sitting import end_sitting, write_missing_results
from study.workflows.session.plan_sitting import plan_sitting
from study.workflows.session.withdraw_participant import list_remaining_copies, plan_withdrawal, withdraw
from study.workflows.trial.display import HumanHand
from study.workflows.views.send_request import send_request
from study.workflows.views.view_home import describe_model_quality, make_home_view, make_protocol_line
from study.workflows.views.view_session import make_session_view

REPLY_POLL_S = 0.5
"""Longest single wait (s) for a reply. Chosen: between two waits an interruption takes effect."""

CALIBRATION_STOPPED = StudyError("The calibration was stopped", "", "Begin it again.", "Nothing was written.")
"""Error of a calibration that the user stopped."""


class EngineCommands:
    """Performs the commands of one screen. `session_folder`: the session that the current command has opened and not
    finished, which can be resumed; None without such a session."""

    def __init__(self, link: ScreenLink) -> None:
        self._link = link
        self._clock = RealClock()
        self.session_folder: SessionFolder | None = None

    def perform(self, command: Command) -> None:
        """Perform one command. Raises StudyError where it fails, KeyboardInterrupt where the user interrupts."""
        self.session_folder = None
        # An interruption that came after the command was sent, but before it was begun, takes effect here.
        if self._link.is_taken_command_interrupted:
            raise KeyboardInterrupt
        match command:
            case ShowHome() | ShowSession() | ShowDiagnosis():
                self._link.send(_read_view(command))
            case BeginSession(order=order):
                self._begin_session(order)
            case Resume():
                self._resume(command)
            case Analyze(session=session):
                self._link.send(PreparationStarted("Making the tables and the report."))
                write_results(SessionFolder(Path(session)))
                self._link.send(SessionContent(make_session_view(Path(session), convert_to_machine_zone)))
            case Withdraw(session=session):
                self._withdraw(SessionFolder(Path(session)))
            case Diagnose():
                self._diagnose(command)
            case CalibrateSensor() | StoreCalibration():
                self._calibrate(command)
            case SendRequest(session=session, request=request):
                send_request(SessionFolder(Path(session)), request, self._clock)

    def _begin_session(self, order: SessionOrder) -> None:
        """Plan and conduct a new session. Notes of the plan are shown to the user."""
        model = Path(order.model) if order.model else None
        plan = plan_sitting(order.protocol, order.subject, None, order.seed, Path(order.data), model)
        for note in plan.notes:
            self._link.send(UserNotice(note))
        words = make_words(plan.session.protocol)
        self._conduct_sitting(
            words, order.device, lambda participant: conduct_new(plan.session, order.device, participant)
        )

    def _resume(self, command: Resume) -> None:
        """Continue a session, or write the missing results of a closed one. Raises WrongUseError for a session of a
        simulated participant."""
        folder = find_session(command.session, Path(command.data))
        folded_session = fold_session(folder)
        observer, device = folded_session.state.opened.observer, folded_session.state.opened.device
        if observer is not None:
            raise WrongUseError(
                "This session belongs to a simulated participant",
                f"'{observer}' began {folder.name}; a person's answers must not be added to it.",
                "Continue it with: " + format_logged_resume_command(str(folder.path), device.name, device.simulated),
                saved="Nothing was changed.",
            )
        if folder_warning := format_data_folder_warning(folder.path.parent):
            self._link.send(UserNotice(folder_warning))
        if folded_session.state.closed:
            self._link.send(PreparationStarted("Making the tables and the report."))
            analysis = write_missing_results(folder, folded_session)
            self._link.send(Finished(str(folder.path), folded_session.state.answers, _make_results_message(analysis)))
            return
        words, device_name = make_words(folded_session.state.protocol), _choose_device(command, device)
        self._conduct_sitting(words, device_name, lambda participant: conduct_resumed(folder, device_name, participant))

    def _conduct_sitting(
        self, words: Words, device_name: str, conduct: Callable[[Participant], ConductedSitting]
    ) -> None:
        """Conduct a sitting, write its results and send them. Raises StudyError, as `end_sitting` does, where the
        session is not finished. words: texts of the protocol's language; device_name: as `open_device` takes it."""
        self._link.send(ParticipantWords(words))
        self._link.send(PreparationStarted(words["preparing_device"]))
        with self._open_participant(device_name) as participant:
            conducted_sitting = conduct(participant)
        if conducted_sitting.state.closed:
            self.session_folder = None  # a closed session cannot be resumed
        if not conducted_sitting.end_reason:
            self._link.send(PreparationStarted(words["preparing_report"]))
        analysis = end_sitting(conducted_sitting, self._clock.utc())
        self._link.send(
            Finished(
                str(conducted_sitting.folder.path), conducted_sitting.state.answers, _make_results_message(analysis)
            )
        )

    @contextlib.contextmanager
    def _open_participant(self, device_name: str) -> Iterator[Participant]:
        """Make the participant at the screen, without requests and replies of an earlier session."""
        self._link.requests.take()  # discard requests to an earlier session
        self._link.drop_replies()
        display = RemoteDisplay(self._link, self._clock)
        try:
            connect = partial(self._register_session, device_name)
            yield Participant(display, HumanHand(), self._clock, self._link.requests, connect)
        finally:
            self._link.stop_device = None

    def _register_session(self, device_name: str, folder: SessionFolder, device: Device) -> None:
        """Store the folder of the opened session, connect the screen's emergency stop to the device, and send the
        session to the screen. Called once session and device are open."""
        self.session_folder = folder
        self._link.stop_device = device.stop
        self._link.send(SessionReady(folder.name, str(folder.path), device_name))

    def _withdraw(self, folder: SessionFolder) -> None:
        """Erase the participant's sessions, and name copies that may exist elsewhere."""
        data_folder = folder.path.parent
        erased = withdraw(data_folder, plan_withdrawal(folder), self._clock.utc())
        for sentence in (*erased.doubtful, *list_remaining_copies(data_folder, erased)):
            self._link.send(UserNotice(sentence))
        self._link.send(Withdrawn(erased.sessions))

    def _diagnose(self, command: Diagnose) -> None:
        """Diagnose recordings, with progress, and send the result."""
        # Imported here, because compilers and solvers take long to load.
        from study.workflows.diagnosis.diagnose_at_screen import choose_result_folder, diagnose_at_screen
        from study.workflows.diagnosis.diagnose_recordings import DiagnosePlan

        self._link.send(DiagnosisProgress("getting ready", 0.0))
        sources = tuple(Path(source) for source in command.sources)
        out_folder = Path(command.out) if command.out else choose_result_folder(sources[0])
        model, reference_recordings = (
            Path(command.model) if command.model else None,
            tuple(Path(path) for path in command.clean),
        )
        plan = DiagnosePlan(sources, out_folder, model, clean=reference_recordings)
        document_path = diagnose_at_screen(
            plan, lambda step, fraction: self._link.send(DiagnosisProgress(step, fraction))
        )
        self._link.send(_read_diagnosis(document_path))

    def _calibrate(self, command: CalibrateSensor | StoreCalibration) -> None:
        """Calibrate the accelerometer with instructions on the screen, or store a calibration. Raises
        CALIBRATION_STOPPED where the user interrupts, KeyboardInterrupt where the screen's process has ended."""
        if isinstance(command, StoreCalibration):
            self._link.send(CalibrationStored(str(save_accelerometer_calibration(command.table))))
            return
        request_numbers = itertools.count(1)
        self._link.drop_replies()

        def request_placement(position: str, readings: tuple[float, float, float] | None) -> None:
            """Ask the user to place the sensor in a position, and wait for the reply. readings: mean raw values of the
            three axes in the previous position; None before the first."""
            request = PlacementRequest(next(request_numbers), position, readings)
            self._link.send(request)
            while (reply := self._link.wait_for_reply(REPLY_POLL_S)) is None or reply.number != request.number:
                pass

        try:
            table = calibrate_accelerometer(command.port, command.baud, request_placement)
        except KeyboardInterrupt:
            if self._link.ended:
                raise
            raise CALIBRATION_STOPPED from None
        self._link.send(CalibrationComputed(table, str(get_lab_file_path())))


def _read_view(command: ShowHome | ShowSession | ShowDiagnosis) -> HomeContent | SessionContent | DiagnosisContent:
    """Read the view that the command requests."""
    match command:
        case ShowHome():
            return HomeContent(_read_home_view(command))
        case ShowSession(path=path):
            return SessionContent(make_session_view(Path(path), convert_to_machine_zone))
        case ShowDiagnosis(path=path):
            return _read_diagnosis(Path(path))


def _read_diagnosis(path: Path) -> DiagnosisContent:
    """Read the view of the diagnosis document at `path`."""
    # Imported here, because compilers and solvers take long to load.
    from study.workflows.views.view_diagnosis import make_diagnosis_view

    return DiagnosisContent(make_diagnosis_view(path))


def _read_home_view(command: ShowHome) -> HomeView:
    """Read the content of the start screen, with the protocol, device and model of the command line first in their
    lists."""
    view = make_home_view(Path(command.data))
    requested_protocol = make_protocol_line(command.protocol, Path(command.data)) if command.protocol else None
    protocols = (
        (
            requested_protocol,
            *(listed_protocol for listed_protocol in view.protocols if listed_protocol.name != requested_protocol.name),
        )
        if requested_protocol
        else view.protocols
    )
    devices = tuple(sorted(view.devices, key=lambda name: name != command.device))
    models = (command.model, *(name for name in view.models if name != command.model)) if command.model else view.models
    known_qualities = dict(view.qualities)
    qualities = tuple((model, known_qualities.get(model) or describe_model_quality(model)) for model in models)
    return replace(view, protocols=protocols, devices=devices, models=models, qualities=qualities)


def _choose_device(command: Resume, logged_device: DeviceFacts) -> str:
    """Choose the name of the device on which a session is resumed. logged_device: that of the session's log."""
    # A simulated session may go on on any simulated device: a log does not name the file of a replay.
    if command.follows_log and (command.device in REAL_DEVICES or not logged_device.simulated):
        return find_device_option(logged_device.name, logged_device.simulated)
    return command.device


def _make_results_message(analysis: WrittenAnalysis) -> Results:
    """Make the message about a written analysis, with thresholds, warnings and path of the report as JSON text too."""
    return Results(
        analysis.table, analysis.warnings, str(analysis.report), json.dumps(analysis.as_document(), indent=2)
    )
