"""`hapteq identify`: a state-space model of a device from recordings.

Steps: remove known effects if wanted; estimate the frequency response and fit the model (`identify_recordings`); test
it by free simulation of held-out segments (`validate_on_test`); write it with quality, place and provenance. The result
also holds what the page about it needs (`report_identification`).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from analysis.wording import capitalise, format_sentence
from equalizer.identification.frequency_response.frequency_response import FrequencyResponse
from equalizer.identification.frequency_response.transfer_estimate import TransferEstimateError
from equalizer.identification.state_space.held_out import HeldOut, validate_on_test
from equalizer.identification.state_space.identify import Identified
from equalizer.identification.state_space.identify_recordings import IdentifiedRecordings, identify_recordings
from equalizer.identification.state_space.misfit import misfit_of_estimate
from equalizer.identification.state_space.misfit_causes import held_out_remarks
from equalizer.identification.state_space.refusals import IdentificationRefused
from equalizer.identification.state_space.settings import IdentificationSettings
from equalizer.plant.identified_model import IdentifiedModel
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.plant.model_quality import ModelQuality, model_quality
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
from study.workflows.free_name import require_free

NEAR_M = 0.001
"""Largest difference (m) per coordinate of places that count as the same: a model holds for a single place."""


@dataclass(frozen=True, slots=True)
class IdentifyPlan:
    """Arguments of `identify_model`: recordings, model file to write, band, order (number of states), and options."""

    recordings: tuple[Path, ...]
    out: Path
    band_hz: tuple[float, float] = (5.0, 35.0)
    order: int = 26
    smooth: bool | None = None
    """Whether the response is smoothed over neighbouring lines before the fit (local polynomials); None: where lines
    scatter more than their noise, as on a nonlinear device."""
    with_spring: bool = False
    """Whether the excitation is taken as input, which makes the virtual spring a part of the model: for playback under
    the same spring without relying on encoders."""
    physics: Path | None = None
    """File of a mechanical model whose named effects are removed from the recordings first: what is identified is then
    the linear remainder. None: nothing is removed."""
    longest_decay_s: float | None = None
    """Upper bound of a pole's time constant (s); None: the default bound, longer where the recordings need it."""


@dataclass(frozen=True, slots=True, eq=False)
class IdentifiedDevice:
    """The written model, and the data for a page about it."""

    plan: IdentifyPlan
    recordings: tuple[Recording, ...]
    estimate: FrequencyResponse
    fitted: FrequencyResponse
    """Frequency response that the model was fitted to: the estimate, or its local averages."""
    identified: Identified
    model: IdentifiedModel
    tested: HeldOut | None
    """Held-out test on recordings processed like the fitted ones; None where no segment was kept for it."""
    not_removed: tuple[str, ...] = ()
    """Sentences on the effects of the mechanical model that stay in the recordings."""

    @property
    def remarks(self) -> tuple[str, ...]:
        """Sentences for the user on the quality of the model, on the estimate and on effects that were not removed."""
        quality_remarks = self.model.quality.remarks if self.model.quality else ()
        not_removed = (f"Not subtracted from the recordings: {sentence}" for sentence in self.not_removed)
        return (*quality_remarks, *(format_sentence(remark) for remark in self.estimate.remarks), *not_removed)


def identify_model(plan: IdentifyPlan, on_progress: Callable[[float], None]) -> IdentifiedDevice:
    """Read recordings, identify a model and write it. `on_progress(share)`, 0 to 1. Raises StudyError where the
    recordings do not suit a model; nothing is written then."""
    settings = _settings(plan)
    check_free(plan.out)
    recordings = tuple(read_recording(path) for path in plan.recordings)
    _check_alike(recordings, plan.with_spring)
    if plan.with_spring:
        recordings = tuple(_from_excitation(recording) for recording in recordings)
    physics = None if plan.physics is None else read_mechanical_model(plan.physics)
    if plan.physics is not None and physics is not None:
        recordings = remove_effects(recordings, physics, plan.physics)
    try:
        identification = identify_recordings(recordings, settings, plan.smooth, on_progress)
        model = _add_place(plan, recordings, identification.identified.model, physics)
        tested = validate_on_test(model, recordings)
        model = replace(model, quality=_quality(identification, recordings, tested))
    except (TransferEstimateError, IdentificationRefused) as refusal:
        raise _no_model(str(refusal)) from refusal
    except np.linalg.LinAlgError as problem:
        raise _no_model(
            f"The fit broke down ({str(problem).rstrip('.')}): an output does not respond, or order {plan.order} is "
            "more than these lines carry."
        ) from problem
    except ValueError as problem:
        raise _no_model(f"{problem}.") from problem
    write_identified_model(plan.out, model)
    not_removed = () if physics is None else explain_unremovable_effects(physics)
    return IdentifiedDevice(
        plan,
        recordings,
        identification.estimate,
        identification.fitted,
        identification.identified,
        model,
        tested,
        not_removed,
    )


def _quality(
    identification: IdentifiedRecordings, recordings: Sequence[Recording], tested: HeldOut | None
) -> ModelQuality:
    """Figures of the quality: misfit, scatter and held-out error. The misfit is that of the estimate itself, even if
    the model was fitted to local averages."""
    identified, estimate = identification.identified, identification.estimate
    misfit = misfit_of_estimate(identified.model, estimate)
    remarks = (*identified.remarks, *held_out_remarks(tested, identified.cost, misfit, recordings))
    measured = None if tested is None else (tested.error, tested.noise, tested.seconds)
    sentences = tuple(format_sentence(remark) for remark in remarks)
    return model_quality(misfit.error, identified.scatter, measured, sentences, misfit.upper_bound)


def check_free(out_path: Path) -> None:
    """Check before any work that the output path can be written. Raises StudyError."""
    require_free(out_path, title="The model was not made", kind="models")


def _settings(plan: IdentifyPlan) -> IdentificationSettings:
    try:
        return IdentificationSettings(plan.band_hz, plan.order, plan.longest_decay_s)
    except ValueError as problem:
        raise WrongUseError(
            "There is no such model",
            f"{problem}.",
            "Correct --band, --order or --longest-decay.",
            saved="Nothing was written.",
        ) from problem


def _add_place(
    plan: IdentifyPlan, recordings: Sequence[Recording], model: IdentifiedModel, physics: MechanicalModel | None
) -> IdentifiedModel:
    """The model with the place of its recordings, and with its provenance: files, hand, spring, input, removed
    effects."""
    provenance = {
        **model.provenance,
        **gather_provenance(parents=(*plan.recordings, *([plan.physics] if plan.physics else []))).as_dict(),
        "device": recordings[0].device,
        "hand": sorted({str(recording.meta.get("hand", "")) for recording in recordings}),
        "feedback": recordings[0].meta.get("feedback"),
        "input": "excitation" if plan.with_spring else "command",
        # None: these effects are compensated fully, because the model contains nothing of them.
        "amplitude_n": _amplitude_n(recordings) if physics is None else None,
        "freed_of": [] if physics is None else list_removable_effects(physics),
    }
    return replace(model, place_m=_common_place(recordings), provenance=provenance)


def _amplitude_n(recordings: Sequence[Recording]) -> float:
    """Largest amplitude (N) of the fitted segments: the model contains the linear equivalent of friction at this
    amplitude."""
    segments = (segment for recording in recordings for segment in recording.segments if segment.role != "test")
    return max((segment.amplitude for segment in segments), default=0.0)


def _check_alike(recordings: Sequence[Recording], with_spring: bool) -> None:
    """Raise StudyError unless all recordings are of the same system: all with a hand or all without, and, where the
    spring becomes part of the model, all under the same spring."""
    values_by_name = {
        "the hand on the handle": {str(r.meta["hand"]) for r in recordings if r.meta.get("hand") is not None}
    }
    if with_spring:
        values_by_name["the spring"] = {_spring_words(r.meta.get("feedback")) for r in recordings}
    for name, values in values_by_name.items():
        if len(values) > 1:
            raise _no_model(f"The recordings differ in {name} ({'; '.join(sorted(values))}); identify each separately.")


def _spring_words(feedback: object) -> str:
    if not isinstance(feedback, dict):
        return "none"
    stiffness, damping = (float(feedback.get(key, 0.0)) for key in ("stiffness_n_per_m", "damping_n_s_per_m"))
    return f"{stiffness:.3g} N/m, {damping:.3g} N s/m"


def _from_excitation(recording: Recording) -> Recording:
    """The recording with the excitation as input, which makes the spring's feedback a part of the model. Raises
    StudyError without an excitation."""
    if recording.excitation is None:
        raise _no_model("The recording does not hold its excitation, so the spring's share is not known.")
    return replace(recording, command=recording.excitation)


def _common_place(recordings: Sequence[Recording]) -> tuple[float, float, float] | None:
    """Place of the recordings (m), that of the first which states it; None without any. Raises ValueError where places
    differ."""
    places = [recording.meta["place_m"] for recording in recordings if recording.meta.get("place_m") is not None]
    if not places:
        return None
    if np.ptp(np.array(places, dtype=float), axis=0).max() > NEAR_M:
        raise ValueError("the recordings were made at different places; identify one model per place")
    x, y, z = (float(component) for component in places[0])
    return x, y, z


def _no_model(explanation: str) -> StudyError:
    return StudyError(
        "No model can be made from these recordings",
        capitalise(explanation),
        "Record what is missing (hapteq record), or choose another --band or --order.",
        saved="Nothing was written.",
    )
