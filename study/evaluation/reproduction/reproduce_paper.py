"""Reproduce the published figures 1 to 5 on the simulated omega.3 (`hapteq reproduce`).

Steps: record the device (`reproduce_recordings`), run the study with simulated participants, identify the models, play
the equalizer and the baselines, write figures, document and page. Sessions, recordings and models are reused by the
next run.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from analysis.evaluation.reproduction.document import UsedModel
from analysis.evaluation.reproduction.measured_device import MeasuredDevice
from analysis.psychophysics.ellipsoid import compute_ellipsoids, read_sensor_frame
from analysis.psychophysics.study_analysis import analyse_study
from equalizer.identification.frequency_response.coupling_onset import find_coupling_onset
from equalizer.identification.frequency_response.resonances import find_resonances
from equalizer.identification.frequency_response.transfer_estimate import TransferEstimateError, estimate_transfer
from equalizer.identification.state_space.held_out_validation import HeldOutValidation, validate_on_test
from equalizer.plant.identified_model import IdentifiedModel
from equalizer.signals.recording import Recording
from study.devices.opening import FRICTIONLESS
from study.errors import StudyError, UserInterruptError, convert_interrupts
from study.evaluation.reproduction.reproduce_baselines import play_baselines
from study.evaluation.reproduction.reproduce_equalized import PlacedModels, play_equalized
from study.evaluation.reproduction.reproduce_recordings import CachedRecording, RecordingRequest, record_or_load
from study.evaluation.reproduction.reproduction_plan import INTERMEDIATE_PLACES, ReproductionPlan, StepProgress
from study.evaluation.reproduction.reproduction_results import ReproductionResults
from study.evaluation.reproduction.write_reproduction import WrittenReproduction, write_reproduction_folder
from study.store.disk.file_errors import UnusableFileError, convert_write_errors
from study.store.disk.provenance import compute_sha256
from study.store.formats.identified_model_file import read_identified_model
from study.store.formats.protocol_files import read_study_protocol
from study.workflows.equalizer.identify_model import IdentifyPlan, identify_model
from study.workflows.results.collect_sessions import collect_sessions
from study.workflows.results.collected_trials import CollectedTrials
from study.workflows.session.rehearse_study import Rehearsal, rehearse_study


@dataclass(frozen=True, slots=True, eq=False)
class ReproducedModel:
    """A model for figure 5, identified from a recording, with its held-out test."""

    model: IdentifiedModel
    """Model that includes the spring, so that playback under the same spring needs no separate compensation."""
    held_out_test: HeldOutValidation | None
    """Test on the held-out part of the recording; None where there is none."""

    def convert_to_used_model(self, name: str) -> UsedModel:
        """Convert to the summary for the report. name: of its recording; underscores become blanks."""
        quality = self.model.quality
        assert quality is not None, "every model that is kept or made here has one"
        assert quality.expected_error is not None, "every sweep has two counted periods"
        return UsedModel(name.replace("_", " "), quality.expected_error, quality.held_out_error, quality.held_out_noise)


def identify_or_load(
    plan: ReproductionPlan, cached_recording: CachedRecording, on_progress: Callable[[float], None]
) -> ReproducedModel:
    """Load the cached model, or identify it; a cached file that is unusable, of another recording, order or band,
    or without its quality, is replaced. on_progress: called with the fraction done, 0 to 1. Raises StudyError where the
    identification fails."""
    path = plan.models / cached_recording.path.name
    model = _load_cached_model(path, plan, cached_recording.path)
    if model is None:
        path.unlink(missing_ok=True)
        identify_plan = IdentifyPlan((cached_recording.path,), path, plan.band_hz, plan.order, with_spring=True)
        model = identify_model(identify_plan, on_progress).model
    on_progress(1.0)
    return ReproducedModel(model, validate_on_test(model, (use_excitation_as_command(cached_recording.recording),)))


def _load_cached_model(path: Path, plan: ReproductionPlan, recording_path: Path) -> IdentifiedModel | None:
    """Load the cached model, if it was identified from the recording at `recording_path` with the order and band of the
    plan and states its quality; else None."""
    try:
        model = read_identified_model(path) if path.exists() else None
    except UnusableFileError:
        return None
    if model is None or model.quality is None or (model.order, model.band_hz) != (plan.order, plan.band_hz):
        return None
    parent_hashes = [parent.get("sha256") for parent in model.provenance.get("parents", ())]
    return model if parent_hashes == [compute_sha256(recording_path)] else None


def use_excitation_as_command(recording: Recording) -> Recording:
    """Replace the command by the excitation, where there is one, so that the spring is part of the device."""
    return replace(recording, command=recording.excitation or recording.command)


(
    SUBJECT_DURATION_S,
    RECORDING_DURATION_S,
    MODEL_DURATION_S,
    PLAYING_DURATION_S,
    BASELINES_DURATION_S,
    WRITING_DURATION_S,
) = 5.0, 2.0, 12.0, 8.0, 12.0, 8.0
"""Approximate duration of each step (s), the first per simulated participant, for the progress only."""

CENTRE_NAME, FRICTIONLESS_NAME, HAND_NAME = "centre", "frictionless", "hand"
"""Names of the recordings at the centre, without friction and with a hand, and of the models identified from them."""


def reproduce_paper(plan: ReproductionPlan, on_progress: Callable[[float], None]) -> WrittenReproduction:
    """Reproduce all figures. on_progress: called with the fraction done, 0 to 1. Raises StudyError where a step fails,
    and UserInterruptError, after which the next call reuses the finished sessions, recordings and models."""
    requests = _list_requests(plan)
    model_names = (CENTRE_NAME, *_list_intermediate_names(), FRICTIONLESS_NAME, HAND_NAME)
    steps = StepProgress(_estimate_step_durations_s(plan, requests, model_names), on_progress)
    saved_text = f"Sessions, recordings and models so far are in {plan.output_folder}."
    with convert_interrupts("The reproduction is not finished.", saved_text, further_types=(UserInterruptError,)):
        _make_folders(plan)
        recordings = {
            name: record_or_load(plan, request, steps.make_callback(f"recording {name}"))
            for name, request in requests.items()
        }
        collected_trials = _rehearse_study(plan, steps)
        identified_models = {
            name: identify_or_load(plan, recordings[name], steps.make_callback(f"model {name}")) for name in model_names
        }
        results = _collect_results(plan, recordings, identified_models, collected_trials, steps)
        return write_reproduction_folder(plan, results, steps.make_callback("writing"))


def _list_requests(plan: ReproductionPlan) -> Mapping[str, RecordingRequest]:
    """List the recordings that the figures need, by name."""
    protocols = plan.protocols
    requests = (
        RecordingRequest("ellipsoid", protocols.ellipsoid),
        RecordingRequest("sweep", protocols.sweep),
        RecordingRequest(CENTRE_NAME, protocols.band),
        *(
            RecordingRequest(name, protocols.band, place)
            for name, place in zip(_list_intermediate_names(), INTERMEDIATE_PLACES, strict=True)
        ),
        RecordingRequest(FRICTIONLESS_NAME, protocols.band, device=FRICTIONLESS),
        RecordingRequest(HAND_NAME, protocols.hand),
    )
    return {request.name: request for request in requests}


def _list_intermediate_names() -> tuple[str, ...]:
    """List the names of the recordings at the intermediate places."""
    return tuple(f"between_{number}" for number in range(1, len(INTERMEDIATE_PLACES) + 1))


def _estimate_step_durations_s(
    plan: ReproductionPlan, requests: Mapping[str, RecordingRequest], model_names: tuple[str, ...]
) -> dict[str, float]:
    """Estimate the duration (s) of each step, by its name, for the progress."""
    return {
        **{f"recording {name}": RECORDING_DURATION_S for name in requests},
        "study": SUBJECT_DURATION_S * plan.subjects / plan.workers,
        **{f"model {name}": MODEL_DURATION_S for name in model_names},
        "playing": PLAYING_DURATION_S,
        "baselines": BASELINES_DURATION_S,
        "writing": WRITING_DURATION_S,
    }


def _make_folders(plan: ReproductionPlan) -> None:
    """Make the folders of sessions, recordings and models. Raises CannotWriteError."""
    for folder in (plan.study, plan.recordings, plan.models):
        with convert_write_errors(folder):
            folder.mkdir(parents=True, exist_ok=True)


def _rehearse_study(plan: ReproductionPlan, steps: StepProgress) -> CollectedTrials:
    """Run the study with simulated participants, and collect its trials."""
    source = read_study_protocol(plan.protocols.study, plan.study)
    rehearsal = Rehearsal(source.protocol, source.text, subjects=plan.subjects, seed=plan.seed, data=plan.study)
    report_share = steps.make_callback("study")
    rehearse_study(rehearsal, plan.workers, lambda subjects_done: report_share(subjects_done / plan.subjects))
    return collect_sessions(plan.study, source.protocol.name)


def _collect_results(
    plan: ReproductionPlan,
    recordings: Mapping[str, CachedRecording],
    identified_models: Mapping[str, ReproducedModel],
    collected_trials: CollectedTrials,
    steps: StepProgress,
) -> ReproductionResults:
    """Compute the results of all figures. Raises StudyError where a recording does not suffice for its figure."""
    models = PlacedModels(
        centre=identified_models[CENTRE_NAME].model,
        intermediate=tuple(identified_models[name].model for name in _list_intermediate_names()),
        frictionless=identified_models[FRICTIONLESS_NAME].model,
        hand=identified_models[HAND_NAME].model,
    )
    centre_recording = recordings[CENTRE_NAME].recording
    try:
        measured_device = _measure_device(recordings["sweep"].recording)
        ellipsoid_recording = recordings["ellipsoid"].recording
        ellipsoid_results = compute_ellipsoids(ellipsoid_recording, read_sensor_frame(ellipsoid_recording))
        frequency_response = estimate_transfer((use_excitation_as_command(centre_recording),))
    except (TransferEstimateError, ValueError) as problem:
        raise StudyError(
            "The recordings do not suffice for the figures",
            f"{problem}.",
            "Take other recording protocols, or another folder with --out.",
            saved=f"Sessions, recordings and models are in {plan.output_folder}.",
        ) from problem
    return ReproductionResults(
        study=analyse_study(collected_trials.trials, collected_trials.protocol),
        ellipsoids=ellipsoid_results,
        device=measured_device,
        device_name=centre_recording.device,
        equalized_playback=play_equalized(plan, models, steps.make_callback("playing")),
        baselines=play_baselines(plan, models, frequency_response, steps.make_callback("baselines")),
        models=tuple(reproduced.convert_to_used_model(name) for name, reproduced in identified_models.items()),
        held_out_test=identified_models[CENTRE_NAME].held_out_test,
        frictionless_test=identified_models[FRICTIONLESS_NAME].held_out_test,
        remarks=tuple(f"{name}: {warning}" for name, recording in recordings.items() for warning in recording.warnings),
        sources=tuple(recording.path for recording in recordings.values()),
        protocol_hash=collected_trials.protocol_hash,
    )


def _measure_device(recording: Recording) -> MeasuredDevice:
    """Estimate the frequency response of the sweep, its resonances and the onset of coupling."""
    response = estimate_transfer((recording,))
    return MeasuredDevice(response, find_resonances(response), find_coupling_onset(response))
