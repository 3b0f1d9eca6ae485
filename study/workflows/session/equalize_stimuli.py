"""Equalizer of a session: load its model, check it against protocol and device, and copy it into the session folder.

With the protocol's quantity "delivered_acceleration", forces are computed from required accelerations by a periodic
inverse of the identified model (`ModelEqualizer`). Levels are still stated as forces in N: `compute_level_scales`
returns for each frequency the level that corresponds to 1 m/s² (see `study.session.facts.level_scale`).
"""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.plant.model_quality import write_quality_sentence
from equalizer.signals.signal import FloatArray
from equalizer.tracking.feedforward.equalizer import Equalizer, IdentityEqualizer
from equalizer.tracking.feedforward.virtual_spring import VirtualSpring
from protocols.definition.study_protocol import StudyProtocol
from study.devices.device import DeviceInfo
from study.errors import StudyError
from study.regular_file import read_regular
from study.session.facts.level_scale import EqualizedFacts, LevelScale
from study.session.state.state import SessionState
from study.session.stimulus.limits import SPRING_SLEW_N_PER_S, compute_highest_level_n, make_study_limits
from study.session.stimulus.stimulus import compute_direction_vector, make_held_stimulus
from study.store.disk.atomic_write import write_atomically
from study.store.disk.provenance import compute_sha256
from study.store.formats.identified_model_file import read_identified_model
from study.store.sessions.archive import SessionFolder
from study.workflows.equalizer.spring_to_compensate import find_spring_to_compensate

MODEL_NAME = "model.h5"
"""File name of the copy of the model in the session folder."""
MAX_PLACE_DISTANCE_M = 0.02
"""Largest distance (m) of the place of identification from the centre of the workspace, where stimuli are played.
Chosen: models identified farther away leave a coupling between the axes as large as that without an equalizer."""

REQUIRED_CHANNELS = (("fx", "fy", "fz"), ("ax", "ay", "az"))
"""Channels of a model of a study, forces, then accelerations: if it has these names, in this order (`_check_axes`)."""
IDENTIFICATION_REMEDY = "Identify it again with hapteq identify."
"""Remedy for an unusable model, for messages."""
MAX_RESPONSE_ERROR = 0.1
"""Largest error, relative to the required acceleration, of the acceleration that the model predicts for the equalized
force of a stimulus. Chosen: within it the level in m/s² is right to 10 %."""


@dataclass(frozen=True, slots=True, eq=False)
class SessionEqualizer:
    """Equalizer of a session's stimuli, with the model and level scales for the log."""

    equalizer: Equalizer
    facts: EqualizedFacts | None
    """Model and level scales for the log; None where forces are commanded."""
    source: Path | None = None
    """Model file to copy into the session folder; None without a model and in a resumed session."""


NO_EQUALIZER = SessionEqualizer(IdentityEqualizer(), None)
"""Identity equalizer of a study whose stimuli are commanded forces."""


def check_model_for_protocol(protocol: StudyProtocol, model_path: Path | None) -> None:
    """Raise StudyError where a model is missing, not needed, or unusable for the protocol (`_check_model`)."""
    needs_model = protocol.stimulus.quantity == "delivered_acceleration"
    if needs_model and model_path is None:
        raise StudyError(
            "This protocol needs an equalizer",
            f"'{protocol.name}' moves the delivered acceleration (stimulus.quantity), and no model was given.",
            "Give one with --model MODEL.h5; hapteq record and hapteq identify make it.",
        )
    if model_path is not None and not needs_model:
        raise StudyError(
            "This protocol does not use a model",
            f"'{protocol.name}' moves the commanded force (stimulus.quantity), so {model_path} would change nothing.",
            "Take --protocol equalized_threshold, or leave out --model.",
        )
    if model_path is not None:
        _check_model(read_identified_model(model_path), protocol, model_path)
        load_equalizer()


def load_equalizer() -> None:
    """Import the equalizer module, which is slow, before a device is opened: its control loop must not be delayed."""
    import equalizer.tracking.feedforward.model_equalizer  # noqa: F401


def equalize_stimuli(protocol: StudyProtocol, model_path: Path | None, info: DeviceInfo) -> SessionEqualizer:
    """Make the equalizer for a protocol and a model that passed `check_model_for_protocol`; `NO_EQUALIZER` without a
    model. Raises StudyError where the model does not match the device (another sample rate or spring), or the onset of
    a stimulus cannot be computed."""
    if model_path is None:
        return NO_EQUALIZER
    model = read_identified_model(model_path)
    equalizer = _make_equalizer(model, protocol, info)
    try:
        scales = compute_level_scales(protocol, equalizer, info.sample_rate_hz)
    except (ValueError, ArithmeticError) as error:  # numerical failure on an invalid model
        raise _make_refusal(f"The onset of a stimulus cannot be computed ({error}).", IDENTIFICATION_REMEDY) from error
    facts = EqualizedFacts(MODEL_NAME, compute_sha256(model_path), scales, write_quality_sentence(model.quality))
    return SessionEqualizer(equalizer, facts, model_path)


def copy_model(equalized: SessionEqualizer, folder: SessionFolder) -> None:
    """Copy the model into the session folder as `MODEL_NAME`, before the log refers to it; does nothing where
    `equalized.source` is None."""
    if equalized.source is not None:
        write_atomically(folder.path / MODEL_NAME, read_regular(equalized.source))


def reload_equalizer(folder: SessionFolder, state: SessionState, info: DeviceInfo) -> SessionEqualizer:
    """Make the equalizer of a resumed session from the model in its folder; `NO_EQUALIZER` where the log states none.
    Raises StudyError where the model is missing, its SHA-256 differs from the log, or it does not match the device."""
    facts = state.opened.equalized
    if facts is None:
        return NO_EQUALIZER
    path = folder.path / facts.model
    if not path.exists() or compute_sha256(path) != facts.sha256:
        raise StudyError(
            "This session's model is not the one it was begun with",
            f"{path} is {'changed' if path.exists() else 'missing'}, and levels would no longer mean the same.",
            "Put the original file back, or begin a new session.",
            saved="Nothing was changed.",
        )
    return SessionEqualizer(_make_equalizer(read_identified_model(path), state.protocol, info), facts)


def compute_level_scales(protocol: StudyProtocol, equalizer: Equalizer, rate_hz: float) -> tuple[LevelScale, ...]:
    """Compute the scale at each frequency of the protocol: the level (N) for 1 m/s², the larger of the two directions'
    values, and the acceleration (m/s²) at the staircase's cap."""
    cap_n = protocol.staircase.cap_n
    scales = []
    for frequency_hz in protocol.all_frequencies_hz:
        n_per_mps2 = max(
            _compute_level_per_acceleration(protocol, equalizer, direction, frequency_hz, rate_hz)
            for direction in (1, 2)
        )
        scales.append(LevelScale(frequency_hz, n_per_mps2, cap_n / n_per_mps2))
    return tuple(scales)


def _compute_level_per_acceleration(
    protocol: StudyProtocol, equalizer: Equalizer, direction: int, frequency_hz: float, rate_hz: float
) -> float:
    """Compute the level (N) for 1 m/s² in direction 1 or 2: the peak of the force for 1 m/s², onset included, or, if
    larger, S / S_max x (highest level).

    S is the largest slope (N/s) of that force, and S_max the slew limit less the allowance for the spring. The second
    value keeps the stimulus at the highest level within the slew limit.
    """
    limits = make_study_limits(protocol)
    unit_vector = compute_direction_vector(protocol.directions, direction)
    stimulus = make_held_stimulus(protocol.stimulus, unit_vector, frequency_hz, 1.0, equalizer, rate_hz)
    forces = stimulus.onset_then_loop
    force_steps = np.diff(np.concatenate([np.zeros((1, 3)), forces, stimulus.loop.samples[:1]]), axis=0)
    slew_limited_n = (
        _find_largest_norm(force_steps)
        * rate_hz
        / (limits.slew_n_per_s - SPRING_SLEW_N_PER_S)
        * compute_highest_level_n(protocol)
    )
    return max(_find_largest_norm(forces), slew_limited_n)


def _find_largest_norm(vectors: FloatArray) -> float:
    """Find the largest Euclidean norm of the rows (n, 3)."""
    return float(np.linalg.norm(vectors, axis=1).max())


def _make_equalizer(model: IdentifiedModel, protocol: StudyProtocol, info: DeviceInfo) -> Equalizer:
    """Make the equalizer of a model; it compensates the spring of the protocol unless the model contains it. Raises
    StudyError for another sample rate than the device's, or another spring in the model."""
    from equalizer.tracking.feedforward.model_equalizer import ModelEqualizer

    if model.sample_rate_hz != info.sample_rate_hz:
        raise _make_refusal(
            f"It runs at {model.sample_rate_hz:g} Hz, the device at {info.sample_rate_hz:g} Hz.",
            "Identify it from recordings of this device.",
        )
    stiffness_n_per_m = info.effective_mass_kg * (2 * math.pi * protocol.spring.natural_frequency_hz) ** 2
    spring = VirtualSpring(stiffness_n_per_m, protocol.spring.damping_n_s_per_m)
    return ModelEqualizer(model, find_spring_to_compensate(model, spring))


def _check_model(model: IdentifiedModel, protocol: StudyProtocol, path: Path) -> None:
    """Raise StudyError for wrong units or channels, an unstable model, a band that lacks a frequency of the protocol, a
    place of identification beyond `MAX_PLACE_DISTANCE_M`, or a prediction error above `MAX_RESPONSE_ERROR`."""
    shape_and_units = (model.D.shape, model.input_unit, model.output_unit)
    if shape_and_units != ((3, 3), "N", "m/s^2"):
        raise _make_refusal(
            f"{path} goes from {model.D.shape[1]} inputs in {model.input_unit} to {model.D.shape[0]} outputs in "
            f"{model.output_unit}; a stimulus needs three forces in N and three accelerations in m/s^2.",
            "Identify a model from a recording of all three axes.",
        )
    if model.spectral_radius >= 1:
        raise _make_refusal(f"The model in {path} is not stable.", IDENTIFICATION_REMEDY)
    low_hz, high_hz = model.band_hz
    uncovered_hz = [
        f"{frequency_hz:g}" for frequency_hz in protocol.all_frequencies_hz if not low_hz <= frequency_hz <= high_hz
    ]
    if uncovered_hz:
        raise _make_refusal(
            f"{path} was made for {low_hz:g} to {high_hz:g} Hz; the protocol also plays {', '.join(uncovered_hz)} Hz.",
            "Identify a model that covers the protocol, such as hapteq identify --band 5 50.",
        )
    if model.place_m is not None and math.dist(model.place_m, (0.0, 0.0, 0.0)) > MAX_PLACE_DISTANCE_M:
        raise _make_refusal(
            f"{path} was identified at {model.place_m} m, and the study is at the centre.",
            "Record and identify at the centre of the workspace.",
        )
    _check_axes(model, path)
    _check_predicted_response(model, protocol, path)


def _check_axes(model: IdentifiedModel, path: Path) -> None:
    """Raise StudyError for the channel names of `REQUIRED_CHANNELS` in another order: forces would act along wrong
    axes. Other names are accepted."""
    for channels, required_channels in zip(
        (model.input_channels, model.output_channels), REQUIRED_CHANNELS, strict=True
    ):
        if set(channels) == set(required_channels) and channels != required_channels:
            raise _make_refusal(
                f"The channels of {path} are {', '.join(channels)}; a stimulus has them in the order "
                f"{', '.join(required_channels)}.",
                "Identify a model from a recording whose channels are in that order.",
            )


def _check_predicted_response(model: IdentifiedModel, protocol: StudyProtocol, path: Path) -> None:
    """Raise StudyError where the predicted acceleration G H w differs from w by more than `MAX_RESPONSE_ERROR` at a
    frequency of the protocol. w: unit vector of a direction; G: response of the model; H: its regularised inverse."""
    from equalizer.plant.model_response import compute_model_response
    from equalizer.tracking.feedforward.periodic_inverse import compute_regularised_inverse

    frequency_hz = np.array(protocol.all_frequencies_hz)
    unit_vectors = np.stack([compute_direction_vector(protocol.directions, direction) for direction in (1, 2)], axis=1)
    with np.errstate(all="ignore"):
        predicted_acceleration = (
            compute_model_response(model, frequency_hz)
            @ compute_regularised_inverse(model, frequency_hz)
            @ unit_vectors
        )
        errors = np.linalg.norm(predicted_acceleration - unit_vectors, axis=1).max(axis=1)
    unreachable_hz = [
        f"{line_hz:g}" for line_hz, error in zip(frequency_hz, errors, strict=True) if not error <= MAX_RESPONSE_ERROR
    ]
    if unreachable_hz:
        raise _make_refusal(
            f"According to {path}, no reasonable force gives the wanted acceleration at "
            f"{', '.join(unreachable_hz)} Hz.",
            "Check units and axes of the recording it was made from, and identify it again.",
        )


def _make_refusal(explanation: str, advice: str) -> StudyError:
    """Make the error for a model that cannot equalize the study; raised before any motion."""
    return StudyError("This model cannot equalize the study", explanation, advice, saved="Nothing moved.")
