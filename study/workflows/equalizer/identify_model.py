"""Identify a linear state-space model of a device from recordings, and write it to a file (`hapteq identify`).

Steps: interpolate isolated samples (`interpolate_all`); subtract the effects of a mechanical model, if one is given;
estimate the frequency response and fit the model (`identify_recordings`); test it by free simulation of held-out
segments (`validate_on_test`); write it with its quality, the position of the handle (place) and provenance.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from analysis.wording import capitalise, format_sentence
from equalizer.identification.frequency_response.frequency_response import FrequencyResponse
from equalizer.identification.frequency_response.transfer_estimate import TransferEstimateError
from equalizer.identification.state_space.held_out_validation import HeldOutValidation, validate_on_test
from equalizer.identification.state_space.identify import IdentificationResult
from equalizer.identification.state_space.identify_recordings import identify_recordings
from equalizer.identification.state_space.misfit_causes import describe_test_error_causes
from equalizer.identification.state_space.refusals import IdentificationError
from equalizer.identification.state_space.settings import IdentificationSettings
from equalizer.plant.identified_model import IdentifiedModel
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.plant.model_quality import ModelQuality, summarise_quality
from equalizer.signals.isolated_samples import interpolate_all
from equalizer.signals.recording import Recording
from study.errors import StudyError, WrongUseError
from study.store.disk.provenance import gather_provenance
from study.store.formats.identified_model_file import write_identified_model
from study.store.formats.mechanical_model_file import read_mechanical_model
from study.store.formats.recording_file import read_recording
from study.workflows.equalizer.recordings_without_effects import (
    explain_unremovable_effects,
    list_removable_effects,
    remove_effects,
)
from study.workflows.equalizer.spring_to_compensate import read_spring
from study.workflows.output_paths import require_new_outputs

SAME_PLACE_TOLERANCE_M = 0.001
"""Largest difference (m) per coordinate of handle positions that count as the same place: a model is valid at a single
place, because the device's dynamics depend on its position. Chosen."""


@dataclass(frozen=True, slots=True)
class IdentifyPlan:
    """Arguments of `identify_model`: recordings, model file to write, band, order (number of states) and options."""

    recordings: tuple[Path, ...]
    out: Path
    band_hz: tuple[float, float] = (5.0, 35.0)
    order: int = 26
    smooth: bool | None = None
    """Whether the frequency response is smoothed over neighbouring lines before the fit (local polynomials). None: only
    if lines scatter more than their noise, as on a nonlinear device."""
    with_spring: bool = False
    """Whether the model's input is the excitation instead of the command, which makes the virtual spring a part of the
    model: for playback under the same spring, without the encoders."""
    physics: Path | None = None
    """File of a mechanical model whose effects are subtracted from the recordings first, so that the linear remainder
    is identified. None: nothing is subtracted."""
    longest_decay_s: float | None = None
    """Upper bound of a pole's time constant (s); None: the default bound, longer where the recordings need it."""


@dataclass(frozen=True, slots=True, eq=False)
class IdentifiedDevice:
    """The written model, and the data for a report about it."""

    plan: IdentifyPlan
    recordings: tuple[Recording, ...]
    """Recordings as fitted: effects subtracted (`plan.physics`), excitation as command (`plan.with_spring`)."""
    estimate: FrequencyResponse
    fitted: FrequencyResponse
    """Frequency response that the model was fitted to: the estimate, or its local averages."""
    identified: IdentificationResult
    model: IdentifiedModel
    held_out_test: HeldOutValidation | None
    """Validation on held-out segments, processed like the fitted ones; None where no segment was held out."""
    unremoved_effects: tuple[str, ...] = ()
    """Sentences on the effects of the mechanical model that stay in the recordings."""

    @property
    def remarks(self) -> tuple[str, ...]:
        """Sentences for the user on the quality of the model, on the estimate and on effects that were not removed."""
        quality_remarks = self.model.quality.remarks if self.model.quality else ()
        effect_remarks = (f"Not subtracted from the recordings: {sentence}" for sentence in self.unremoved_effects)
        return (*quality_remarks, *(format_sentence(remark) for remark in self.estimate.remarks), *effect_remarks)


def identify_model(plan: IdentifyPlan, on_progress: Callable[[float], None]) -> IdentifiedDevice:
    """Read recordings, identify a model and write it. on_progress: called with the completed share, 0 to 1. Raises
    StudyError if no model can be made from the recordings; nothing is written then."""
    settings = _make_settings(plan)
    require_new_output(plan.out)
    recordings, interpolation_remarks = interpolate_all(
        [read_recording(path) for path in plan.recordings], [path.name for path in plan.recordings]
    )
    _require_same_system(recordings, plan.with_spring)
    if plan.with_spring:
        recordings = tuple(_use_excitation_as_input(recording) for recording in recordings)
    physics = None if plan.physics is None else read_mechanical_model(plan.physics)
    if plan.physics is not None and physics is not None:
        recordings = remove_effects(recordings, physics, plan.physics)
    try:
        identification = identify_recordings(recordings, settings, plan.smooth, on_progress)
        remarks = (*interpolation_remarks, *identification.identified.remarks)
        identified = replace(identification.identified, remarks=remarks)
        model = _add_provenance(plan, recordings, identified.model, physics)
        held_out_test = validate_on_test(model, recordings)
        model = replace(model, quality=_assess_quality(identified, recordings, held_out_test))
    except (TransferEstimateError, IdentificationError) as refusal:
        raise _make_error(str(refusal)) from refusal
    except np.linalg.LinAlgError as error:
        raise _make_error(
            f"The fit broke down ({str(error).rstrip('.')}): an output does not respond, or order {plan.order} is "
            "more than these lines carry."
        ) from error
    except ValueError as error:
        raise _make_error(f"{error}.") from error
    write_identified_model(plan.out, model)
    unremoved_effects = () if physics is None else explain_unremovable_effects(physics, recordings[0].command.channels)
    return IdentifiedDevice(
        plan, recordings, identification.estimate, identification.fitted, identified, model, held_out_test,
        unremoved_effects,
    )  # fmt: skip


def _assess_quality(
    identified: IdentificationResult, recordings: Sequence[Recording], held_out_test: HeldOutValidation | None
) -> ModelQuality:
    """Assess the quality of the model: misfit, scatter and held-out error."""
    misfit = identified.misfit
    remarks = (*identified.remarks, *describe_test_error_causes(held_out_test, identified.cost, misfit, recordings))
    held_out_figures = (
        None if held_out_test is None else (held_out_test.error, held_out_test.noise, held_out_test.seconds)
    )
    remark_sentences = tuple(format_sentence(remark) for remark in remarks)
    return summarise_quality(misfit.error, identified.scatter, held_out_figures, remark_sentences, misfit.upper_bound)


def require_new_output(out_path: Path) -> None:
    """Check, before any work, that the output file does not exist and its folder does. Raises StudyError."""
    require_new_outputs(out_path, title="The model was not made", kind="models")


def _make_settings(plan: IdentifyPlan) -> IdentificationSettings:
    """Make the settings of the fit. Raises WrongUseError for an invalid band, order or decay."""
    try:
        return IdentificationSettings(plan.band_hz, plan.order, plan.longest_decay_s)
    except ValueError as error:
        raise WrongUseError(
            "There is no such model",
            f"{error}.",
            "Correct --band, --order or --longest-decay.",
            saved="Nothing was written.",
        ) from error


def _add_provenance(
    plan: IdentifyPlan, recordings: Sequence[Recording], model: IdentifiedModel, physics: MechanicalModel | None
) -> IdentifiedModel:
    """Add to the model the place of its recordings and its provenance: files, whether a hand was on the handle, spring,
    input, subtracted effects."""
    provenance = {
        **model.provenance,
        **gather_provenance(parents=(*plan.recordings, *([plan.physics] if plan.physics else []))).as_dict(),
        "device": recordings[0].device,
        "hand": sorted({str(recording.meta.get("hand", "")) for recording in recordings}),
        "feedback": recordings[0].meta.get("feedback"),
        "input": "excitation" if plan.with_spring else "command",
        # None: playback compensates the subtracted effects fully, because the model contains no equivalent of them.
        "amplitude_n": _find_peak_amplitude_n(recordings) if physics is None else None,
        "freed_of": [] if physics is None else list_removable_effects(physics, recordings[0].command.channels),
    }
    return replace(model, place_m=_find_common_place(recordings), provenance=provenance)


def _find_peak_amplitude_n(recordings: Sequence[Recording]) -> float:
    """Find the largest amplitude (N) of the fitted segments; 0 without any."""
    segments = (segment for recording in recordings for segment in recording.segments if segment.role != "test")
    return max((segment.amplitude for segment in segments), default=0.0)


def _require_same_system(recordings: Sequence[Recording], with_spring: bool) -> None:
    """Raise StudyError unless all recordings are of the same system: all that state it with a hand or all without, and,
    where the spring becomes part of the model, all under the same spring."""
    values_by_name = {
        "the hand on the handle": {
            str(recording.meta["hand"]) for recording in recordings if recording.meta.get("hand") is not None
        }
    }
    if with_spring:
        values_by_name["the spring"] = {_describe_spring(recording.meta.get("feedback")) for recording in recordings}
    for name, values in values_by_name.items():
        if len(values) > 1:
            raise _make_error(
                f"The recordings differ in {name} ({'; '.join(sorted(values))}); identify each separately."
            )


def _describe_spring(feedback: object) -> str:
    """Describe stiffness and damping of the virtual spring, from a recording's `feedback`; "none" without a spring."""
    spring = read_spring(feedback)
    if not spring:
        return "none"
    stiffness_n_per_m, damping_n_s_per_m = (
        float(spring.get(key, 0.0)) for key in ("stiffness_n_per_m", "damping_n_s_per_m")
    )
    return f"{stiffness_n_per_m:.3g} N/m, {damping_n_s_per_m:.3g} N s/m"


def _use_excitation_as_input(recording: Recording) -> Recording:
    """Replace the command of the recording by its excitation, which makes the spring's feedback a part of the model.
    Raises StudyError if the recording contains no excitation."""
    if recording.excitation is None:
        raise _make_error("The recording does not hold its excitation, so the spring's share is not known.")
    return replace(recording, command=recording.excitation)


def _find_common_place(recordings: Sequence[Recording]) -> tuple[float, float, float] | None:
    """Find the position of the handle (x, y, z; m) in the first recording that states it; None if none does. Raises
    ValueError if a place is not three numbers, or the places differ by more than `SAME_PLACE_TOLERANCE_M`."""
    places = [
        _read_place(recording.meta["place_m"]) for recording in recordings if recording.meta.get("place_m") is not None
    ]
    if not places:
        return None
    if np.ptp(np.array(places), axis=0).max() > SAME_PLACE_TOLERANCE_M:
        raise ValueError("the recordings were made at different places; identify one model per place")
    return places[0]


def _read_place(value: object) -> tuple[float, float, float]:
    """Read a position (x, y, z; m) from a recording's meta. Raises ValueError unless it is three finite numbers."""
    try:
        place = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        place = np.empty(0)
    if place.shape == (3,) and np.isfinite(place).all():
        return float(place[0]), float(place[1]), float(place[2])
    raise ValueError(f"place_m of a recording is {value!r}; it must be three numbers, x, y and z in m")


def _make_error(explanation: str) -> StudyError:
    """Make the error for recordings from which no model can be made."""
    return StudyError(
        "No model can be made from these recordings",
        capitalise(explanation),
        "Record what is missing (hapteq record), or choose another --band or --order.",
        saved="Nothing was written.",
    )
