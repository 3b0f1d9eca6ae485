"""Input checks of a diagnosis: recordings of one device, a model of that device, enough data. Recordings that fail are
refused and get no verdict, not even `unexplained`. Called by `study.workflows.diagnosis` and `prepare_recordings`."""

from collections.abc import Iterator, Sequence

import numpy as np

from analysis.diagnosis.data.driven_response import compute_response_significance
from analysis.diagnosis.data.observed_parts import count_fit_samples
from analysis.diagnosis.data.recorded_conditions import find_payload_problems
from analysis.diagnosis.limits import (
    CYCLES_SHARE,
    DRIVEN_DEVIATIONS,
    LARGEST_VALUE,
    LEAST_CYCLES,
    LEAST_SAMPLES,
    LEAST_SAMPLES_TO_FIT,
    MOST_GROWTH,
    SHORTEST_S,
    SHORTEST_SAMPLES,
)
from equalizer.effects.placing import PlacingError, place_recorded_effects
from equalizer.plant.linear_simulation import compute_growth_rate, compute_poles
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.listed_problems import ListedProblemsError
from equalizer.signals.recording import Recording
from equalizer.signals.recording_checks import find_unusable_channels, format_channels, list_recording_problems
from equalizer.signals.signal import Signal


class NothingToDiagnoseError(ListedProblemsError):
    """The recordings cannot be diagnosed. `problems`: one sentence each, without a full stop."""


def require_comparable(
    recordings: Sequence[Recording], names: Sequence[str], remedy: str = "diagnose them one at a time"
) -> None:
    """Require consistent recordings (`list_recording_problems`) with the same channels, units and rate. Raises
    NothingToDiagnoseError otherwise. names: of the recordings. remedy: clause that ends each difference."""
    if not recordings:
        raise NothingToDiagnoseError(("there is no recording",))
    reference, problems = recordings[0], list(list_recording_problems(recordings, names))
    for recording, name in zip(recordings[1:], names[1:], strict=True):
        for property_name, expected, actual in (
            ("sample rate", f"{reference.sample_rate_hz:g} Hz", f"{recording.sample_rate_hz:g} Hz"),
            ("command", format_channels(reference.command), format_channels(recording.command)),
            ("response", format_channels(reference.response), format_channels(recording.response)),
        ):
            if expected != actual:
                problems.append(f"{name} has the {property_name} {actual}, {names[0]} has {expected}; {remedy}")
    if problems:
        raise NothingToDiagnoseError(tuple(problems))


def require_usable_data(
    recordings: Sequence[Recording], names: Sequence[str], allow_short: bool = False
) -> tuple[str, ...]:
    """Require a command without gaps, and responses that change and depend on it, for long enough. allow_short: whether
    recordings with at least `LEAST_SAMPLES` samples that are too short to name physics are accepted, and a sentence
    about that is returned. Raises NothingToDiagnoseError."""
    problems = [
        gap for recording, name in zip(recordings, names, strict=True) for gap in _find_gaps(recording.command, name)
    ]
    problems += [
        problem
        for recording, name in zip(recordings, names, strict=True)
        for problem in _find_impossible_values(recording, name)
    ]
    problems += _find_constant_signals(recordings)
    shortness: tuple[str, ...] = ()
    if not problems:
        answered_samples = _count_answered_samples(recordings)
        shortness = tuple(_describe_shortness(recordings))
        if answered_samples < LEAST_SAMPLES:
            problems.append(
                f"{answered_samples} samples are too short a recording; at least {LEAST_SAMPLES} are needed"
            )
        elif shortness and not allow_short:
            problems += shortness
        elif (count := count_fit_samples(recordings)) < LEAST_SAMPLES_TO_FIT:
            problems.append(
                f"only {count} samples that may be fitted have a response (and a position, if one was recorded); the "
                "others are missing or have the role of a test"
            )
        elif (
            not shortness
            and (significance := compute_response_significance(recordings)) is not None
            and significance < DRIVEN_DEVIATIONS
        ):
            problems.append(
                "the responses are not related to the commands: their coherence is no larger than that of noise, so "
                "the recording is noise or of another device, or its command was not played"
            )
    if problems:
        raise NothingToDiagnoseError(tuple(problems))
    return shortness


def is_too_short_to_name(recordings: Sequence[Recording]) -> bool:
    """Whether recordings are so short, in samples and in s, that other laws would explain them about as well."""
    answered_samples = _count_answered_samples(recordings)
    return answered_samples < SHORTEST_SAMPLES and answered_samples / recordings[0].sample_rate_hz < SHORTEST_S


def _count_answered_samples(recordings: Sequence[Recording]) -> int:
    """Count the samples, over all recordings, in which no response is missing."""
    return sum(int(np.isfinite(recording.response.samples).all(axis=1).sum()) for recording in recordings)


def _describe_shortness(recordings: Sequence[Recording]) -> Iterator[str]:
    """Yield a sentence for recordings with too few samples, or else with too few cycles of the command."""
    if is_too_short_to_name(recordings):
        count = _count_answered_samples(recordings)
        yield (
            f"{count} samples, {count / recordings[0].sample_rate_hz:.3g} s, are too short to identify physics; at "
            f"least {SHORTEST_S:g} s or {SHORTEST_SAMPLES} samples are needed, one part to fit and one to test"
        )
    elif (cycles := sum(_count_command_cycles(recording) for recording in recordings)) < LEAST_CYCLES:
        yield (
            f"the recording holds about {cycles:.2g} cycles of the command, which is too short; at least "
            f"{LEAST_CYCLES:g} are needed, one part to fit and one to test"
        )


def require_model_of(model: MechanicalModel, recordings: Sequence[Recording]) -> None:
    """Require a model that fits the recordings' device: channels, quantities, units, magnitudes, payloads, modes and
    effects. recordings: with the same channels, units and rate. Raises NothingToDiagnoseError."""
    first_recording = recordings[0]
    names = [recording.device or f"recording {number}" for number, recording in enumerate(recordings, 1)]
    problems = (
        *_compare_channel_counts(model, first_recording),
        *_compare_quantities(model, first_recording),
        *_find_impossible_model_values(model),
    )
    problems = problems or find_payload_problems(model, recordings, names)
    if not problems:
        problems = (
            *_find_unconnected_channels(model, first_recording),
            *_find_instability(model, recordings),
            *_find_too_fast_modes(model, first_recording),
            *_find_misplaced_effects(model, first_recording),
        )
    if problems:
        raise NothingToDiagnoseError(problems)


def _find_gaps(command: Signal, name: str) -> Iterator[str]:
    """Yield a sentence for a command with missing samples. name: of its recording."""
    missing_count = int((~np.isfinite(command.samples)).any(axis=1).sum())
    if missing_count:
        first_missing = int(np.argmax((~np.isfinite(command.samples)).any(axis=1)))
        yield (
            f"{name} has no command in {missing_count} samples (the first is {first_missing}), so the command to the "
            "device is not known there; cut the recording there, or let its import bridge them (gap_s of the clock)"
        )


def _find_impossible_values(recording: Recording, name: str) -> Iterator[str]:
    """Yield a sentence for each channel with a magnitude above `LARGEST_VALUE`."""
    for signal_name in ("command", "response", "position"):
        signal: Signal | None = getattr(recording, signal_name)
        for channel in range(0 if signal is None else len(signal.channels)):
            assert signal is not None
            largest = float(np.nanmax(np.abs(signal.samples[:, channel]), initial=0.0))
            if largest > LARGEST_VALUE:
                yield (
                    f"{name} holds values up to {largest:.3g} {signal.units[channel]} in {signal_name} "
                    f"{signal.channels[channel]}, which no device reaches"
                )


def _find_constant_signals(recordings: Sequence[Recording]) -> Iterator[str]:
    """Yield sentences for commands that are constant, responses that are constant or missing, and missing positions."""
    if all(np.ptp(recording.command.samples, axis=0).max(initial=0.0) == 0 for recording in recordings):
        yield (
            "the command never changes, so the device was not excited; a free motion, measured as positions or speeds "
            "over time, is diagnosed without a model"
        )
    for signal_name in ("response", "position"):
        signals = [signal for recording in recordings if (signal := getattr(recording, signal_name)) is not None]
        for name, is_empty in find_unusable_channels(signals):
            if is_empty:
                yield f"{signal_name} {name} contains only missing values"
            elif signal_name == "response":
                yield f"{signal_name} {name} never changes: it was not connected, or nothing moved"


def _count_command_cycles(recording: Recording) -> float:
    """Count the cycles in the recording of the frequency below which most of the command's power lies, its mean
    removed."""
    power = (np.abs(np.fft.rfft(recording.command.samples, axis=0)) ** 2).sum(axis=1)
    power[0] = 0.0
    return float(np.searchsorted(np.cumsum(power), CYCLES_SHARE * power.sum())) if power.any() else 0.0


def _compare_channel_counts(model: MechanicalModel, recording: Recording) -> Iterator[str]:
    """Yield a sentence for commands, and one for responses, whose number differs from that of the model."""
    for signal_name, expected, channels in (
        ("command", model.inputs, recording.command.channels),
        ("response", model.outputs, recording.response.channels),
    ):
        if expected != len(channels):
            port = "input" if signal_name == "command" else "output"
            yield (
                f"the model has {expected} {port}{'s' if expected != 1 else ''}, but the recording has {len(channels)} "
                f"{signal_name} channel{'s' if len(channels) != 1 else ''} ({', '.join(channels)})"
            )


def _compare_quantities(model: MechanicalModel, recording: Recording) -> Iterator[str]:
    """Yield a sentence for other quantities than the model's, and one for translation in place of rotation."""
    other_quantities = [quantity for quantity in recording.response.quantities if quantity != model.quantity]
    if other_quantities:
        quantity_names = ", ".join(sorted(set(other_quantities)))
        yield f"the model's response is {model.quantity}, but the recording's is {quantity_names}"
    is_rotational = _is_rotational(recording)
    if is_rotational is not None and is_rotational != model.rotational:
        descriptions = ("translational (kg, N, m)", "rotational (kg m^2, N m, rad)")
        model_kind, recording_kind = descriptions[model.rotational], descriptions[is_rotational]
        yield f"the model is {model_kind}, but the recording is {recording_kind}: {format_channels(recording.response)}"


def _is_rotational(recording: Recording) -> bool | None:
    """Whether the response is an angle or its derivative; None where the units do not determine it, such as volts."""
    units = recording.response.units
    if any(unit.split("/")[0] == "rad" for unit in units):
        return True
    return False if any(unit.split("/")[0] == "m" for unit in units) else None


def _find_impossible_model_values(model: MechanicalModel) -> Iterator[str]:
    """Yield a sentence for each matrix with an entry above `LARGEST_VALUE`, and one for a mass below its inverse."""
    for name in ("mass", "damping", "stiffness", "input", "output"):
        largest = float(np.abs(getattr(model, name)).max())
        if largest > LARGEST_VALUE:
            yield f"the model's {name} contains {largest:.3g}, which no device has"
    if (least_mass := float(np.linalg.eigvalsh(model.mass)[0])) < 1 / LARGEST_VALUE:
        yield f"the model's lightest motion has a mass of {least_mass:.3g}, which no device has"


def _find_unconnected_channels(model: MechanicalModel, recording: Recording) -> Iterator[str]:
    """Yield sentences for inputs of the model that drive nothing, or the same motion as another, and outputs that
    measure nothing."""
    idle = [name for name, column in zip(recording.command.channels, model.input.T, strict=True) if not column.any()]
    unmeasured = [name for name, row in zip(recording.response.channels, model.output, strict=True) if not row.any()]
    if idle:
        yield f"in the model's input matrix no coordinate is driven by {', '.join(idle)}"
    elif (rank := int(np.linalg.matrix_rank(model.input))) < model.inputs:
        yield (
            f"the model's {model.inputs} inputs drive only {rank} motion{'s' if rank != 1 else ''}, so they cannot "
            "be distinguished; combine the commands that push the same motion into one"
        )
    if unmeasured:
        yield f"in the model's output matrix no coordinate is measured by {', '.join(unmeasured)}"


def _find_instability(model: MechanicalModel, recordings: Sequence[Recording]) -> Iterator[str]:
    """Yield a sentence for a model whose motion grows by over exp(`MOST_GROWTH`) within the longest recording."""
    growth_per_s = compute_growth_rate(model)
    longest_s = max(len(recording) / recording.sample_rate_hz for recording in recordings)
    if growth_per_s * longest_s > MOST_GROWTH:
        yield (
            f"the model is unstable: without a force its motion grows e-fold in {1 / growth_per_s:.3g} s; damping and "
            "stiffness must not be negative"
        )


def _find_too_fast_modes(model: MechanicalModel, recording: Recording) -> Iterator[str]:
    """Yield a sentence for a slowest mode above half the sample rate (Nyquist frequency): most likely the rate is
    stated a thousand times too low."""
    natural_hz = np.abs(compute_poles(model).imag) / (2 * np.pi)
    slowest_hz = min((float(mode_hz) for mode_hz in natural_hz if mode_hz > 0), default=0.0)
    if slowest_hz > recording.sample_rate_hz / 2:
        yield (
            f"the model's lowest natural frequency is {slowest_hz:.3g} Hz, above half the sample rate of "
            f"{recording.sample_rate_hz:g} Hz; the recording must state its rate in hertz"
        )


def _find_misplaced_effects(model: MechanicalModel, recording: Recording) -> Iterator[str]:
    """Yield a sentence for an effect of the model at a place that the recorded device does not have."""
    try:
        place_recorded_effects(model, recording)
    except PlacingError as problem:
        yield str(problem)
