"""Input checks of a diagnosis: recordings of one device, a model of that device, enough data. Recordings that fail are
refused and get no verdict, not even `unexplained`."""

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np

from analysis.diagnosis.data.driven_response import response_significance
from analysis.diagnosis.data.observed_parts import samples_to_fit
from analysis.diagnosis.data.recorded_conditions import weight_problems
from analysis.diagnosis.settings import (
    ANSWER_DEVIATIONS,
    CYCLES_SHARE,
    LARGEST_VALUE,
    LEAST_CYCLES,
    LEAST_SAMPLES,
    LEAST_SAMPLES_TO_FIT,
    MOST_GROWTH,
    SHORTEST_S,
    SHORTEST_SAMPLES,
)
from equalizer.effects.placing import PlacingError, place_recorded_effects
from equalizer.plant.linear_simulation import free_motion_rates, growth_rate
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.listed_problems import ListedProblemsError
from equalizer.signals.recording import Recording
from equalizer.signals.recording_checks import channels_text, unusable_channels
from equalizer.signals.signal import Signal


class NothingToDiagnose(ListedProblemsError):  # noqa: N818 - an answer that a user reads
    """The recordings cannot be diagnosed. `problems`: one sentence each, without a full stop."""


def require_alike(
    recordings: Sequence[Recording], names: Sequence[str], what_now: str = "diagnose them one at a time"
) -> None:
    """Requires recordings with the same channels, units and rate. Raises NothingToDiagnose."""
    if not recordings:
        raise NothingToDiagnose(("there is no recording",))
    first, problems = recordings[0], []
    for other, name in zip(recordings[1:], names[1:], strict=True):
        for what, expected, two in (
            ("sample rate", f"{first.sample_rate_hz:g} Hz", f"{other.sample_rate_hz:g} Hz"),
            ("command", channels_text(first.command), channels_text(other.command)),
            ("response", channels_text(first.response), channels_text(other.response)),
        ):
            if expected != two:
                problems.append(f"{name} has the {what} {two}, {names[0]} has {expected}; {what_now}")
    if problems:
        raise NothingToDiagnose(tuple(problems))


def require_something(recordings: Sequence[Recording], names: Sequence[str], short: bool = False) -> tuple[str, ...]:
    """Requires a command without gaps, and responses that change and depend on it, for long enough. short: a slightly
    short recording gives a returned sentence instead of a refusal. Raises NothingToDiagnose."""
    problems = [
        problem for recording, name in zip(recordings, names, strict=True) for problem in _gaps(recording.command, name)
    ]
    problems += [
        problem
        for recording, name in zip(recordings, names, strict=True)
        for problem in _impossible_values(recording, name)
    ]
    problems += _constant_signals(recordings)
    few: tuple[str, ...] = ()
    if not problems:
        known = _count_answered_samples(recordings)
        few = tuple(_shortness(recordings))
        if known < LEAST_SAMPLES:
            problems.append(f"{known} samples are too short a recording; at least {LEAST_SAMPLES} are needed")
        elif few and not short:
            problems += few
        elif (fitted := samples_to_fit(recordings)) < LEAST_SAMPLES_TO_FIT:
            problems.append(
                f"only {fitted} samples that may be fitted have a response (and a position, if one was recorded); the "
                "others are missing or have the role of a test"
            )
        elif not few and (sure := response_significance(recordings)) is not None and sure < ANSWER_DEVIATIONS:
            problems.append(
                "the responses are not related to the commands: their coherence is no larger than that of noise, so "
                "the recording is noise or of another device, or its command was not played"
            )
    if problems:
        raise NothingToDiagnose(tuple(problems))
    return few


def is_too_short_to_name(recordings: Sequence[Recording]) -> bool:
    """Whether recordings are so short that other laws would explain them about as well."""
    known = _count_answered_samples(recordings)
    return known < SHORTEST_SAMPLES and known / recordings[0].sample_rate_hz < SHORTEST_S


def _count_answered_samples(recordings: Sequence[Recording]) -> int:
    return sum(int(np.isfinite(recording.response.samples).all(axis=1).sum()) for recording in recordings)


def _shortness(recordings: Sequence[Recording]) -> Iterator[str]:
    if is_too_short_to_name(recordings):
        known = _count_answered_samples(recordings)
        yield (
            f"{known} samples, {known / recordings[0].sample_rate_hz:.3g} s, are too short to identify physics; at "
            f"least {SHORTEST_S:g} s or {SHORTEST_SAMPLES} samples are needed, one part to fit and one to test"
        )
    elif (cycles := sum(_command_cycles(recording) for recording in recordings)) < LEAST_CYCLES:
        yield (
            f"the recording holds about {cycles:.2g} cycles of the command, which is too short; at least "
            f"{LEAST_CYCLES:g} are needed, one part to fit and one to test"
        )


def require_different(recordings: Sequence[Recording], names: Sequence[str]) -> None:
    """Requires recordings that differ: a duplicate would be tested by the data that it was fitted to. Raises
    NothingToDiagnose."""
    problems = [
        f"{names[two]} holds the same samples as {names[first]}, and a recording counts once"
        for first, two in combinations(range(len(recordings)), 2)
        if np.array_equal(recordings[first].response.samples, recordings[two].response.samples, equal_nan=True)
        and np.array_equal(recordings[first].command.samples, recordings[two].command.samples, equal_nan=True)
    ]
    if problems:
        raise NothingToDiagnose(tuple(problems))


def require_model_of(model: MechanicalModel, recordings: Sequence[Recording]) -> None:
    """Requires a model that fits the recordings' device. recordings: alike. Raises NothingToDiagnose."""
    first = recordings[0]
    names = [recording.device or f"recording {number}" for number, recording in enumerate(recordings, 1)]
    problems = (
        *_unlike_channel_counts(model, first),
        *_unlike_quantities(model, first),
        *_impossible_model_values(model),
    )
    problems = problems or weight_problems(model, recordings, names)
    if not problems:
        problems = (
            *_find_unconnected_channels(model, first),
            *_instability(model, recordings),
            *_too_fast_modes(model, first),
            *_find_misplaced_effects(model, first),
        )
    if problems:
        raise NothingToDiagnose(problems)


def _gaps(command: Signal, name: str) -> Iterator[str]:
    missing = int((~np.isfinite(command.samples)).any(axis=1).sum())
    if missing:
        first = int(np.argmax((~np.isfinite(command.samples)).any(axis=1)))
        yield (
            f"{name} has no command in {missing} samples (the first is {first}), so the command to the device is not "
            "known there; cut the recording there, or let its import bridge them (gap_s of the clock)"
        )


def _impossible_values(recording: Recording, name: str) -> Iterator[str]:
    for side in ("command", "response", "position"):
        signal: Signal | None = getattr(recording, side)
        for channel in range(0 if signal is None else len(signal.channels)):
            assert signal is not None
            size = float(np.nanmax(np.abs(signal.samples[:, channel]), initial=0.0))
            if size > LARGEST_VALUE:
                yield (
                    f"{name} holds values up to {size:.3g} {signal.units[channel]} in {side} "
                    f"{signal.channels[channel]}, which no device reaches"
                )


def _constant_signals(recordings: Sequence[Recording]) -> Iterator[str]:
    if all(np.ptp(recording.command.samples, axis=0).max(initial=0.0) == 0 for recording in recordings):
        yield (
            "the command never changes, so the device was not excited; a free motion, measured as positions or speeds "
            "over time, is diagnosed without a model"
        )
    for side in ("response", "position"):
        signals = [found for recording in recordings if (found := getattr(recording, side)) is not None]
        for name, empty in unusable_channels(signals):
            if empty:
                yield f"{side} {name} contains only missing values"
            elif side == "response":
                yield f"{side} {name} never changes: it was not connected, or nothing moved"


def _command_cycles(recording: Recording) -> float:
    """Number of cycles in the recording of the frequency below which most of the command's power lies, its mean
    removed."""
    power = (np.abs(np.fft.rfft(recording.command.samples, axis=0)) ** 2).sum(axis=1)
    power[0] = 0.0
    return float(np.searchsorted(np.cumsum(power), CYCLES_SHARE * power.sum())) if power.any() else 0.0


def _unlike_channel_counts(model: MechanicalModel, recording: Recording) -> Iterator[str]:
    for side, own, channels in (
        ("command", model.inputs, recording.command.channels),
        ("response", model.outputs, recording.response.channels),
    ):
        if own != len(channels):
            whose = "input" if side == "command" else "output"
            yield (
                f"the model has {own} {whose}{'s' if own != 1 else ''}, but the recording has {len(channels)} "
                f"{side} channel{'s' if len(channels) != 1 else ''} ({', '.join(channels)})"
            )


def _unlike_quantities(model: MechanicalModel, recording: Recording) -> Iterator[str]:
    other = [quantity for quantity in recording.response.quantities if quantity != model.quantity]
    if other:
        words = ", ".join(sorted(set(other)))
        yield f"the model answers with {model.quantity}, but the recording's response is {words}"
    turning = _is_rotational(recording)
    if turning is not None and turning != model.rotational:
        kinds = ("translational (kg, N, m)", "rotational (kg m^2, N m, rad)")
        own, its = kinds[model.rotational], kinds[turning]
        yield f"the model is {own}, but the recording is {its}: {channels_text(recording.response)}"


def _is_rotational(recording: Recording) -> bool | None:
    """Whether the response is an angle or its derivative; None where the units do not determine it, such as volts."""
    units = recording.response.units
    if any(unit.split("/")[0] == "rad" for unit in units):
        return True
    return False if any(unit.split("/")[0] == "m" for unit in units) else None


def _impossible_model_values(model: MechanicalModel) -> Iterator[str]:
    for name in ("mass", "damping", "stiffness", "input", "output"):
        size = float(np.abs(getattr(model, name)).max())
        if size > LARGEST_VALUE:
            yield f"the model's {name} contains {size:.3g}, which no device has"
    if (lightest := float(np.linalg.eigvalsh(model.mass)[0])) < 1 / LARGEST_VALUE:
        yield f"the model's lightest motion has a mass of {lightest:.3g}, which no device has"


def _find_unconnected_channels(model: MechanicalModel, recording: Recording) -> Iterator[str]:
    """Inputs of the model that drive nothing, or the same motion as another, and outputs that measure nothing."""
    idle = [name for name, column in zip(recording.command.channels, model.input.T, strict=True) if not column.any()]
    unconnected = [name for name, row in zip(recording.response.channels, model.output, strict=True) if not row.any()]
    if idle:
        yield f"in the model's input matrix no coordinate is driven by {', '.join(idle)}"
    elif (apart := int(np.linalg.matrix_rank(model.input))) < model.inputs:
        yield (
            f"the model's {model.inputs} inputs drive only {apart} motion{'s' if apart != 1 else ''}, so they cannot "
            "be distinguished; combine the commands that push the same motion into one"
        )
    if unconnected:
        yield f"in the model's output matrix no coordinate is measured by {', '.join(unconnected)}"


def _instability(model: MechanicalModel, recordings: Sequence[Recording]) -> Iterator[str]:
    fastest = growth_rate(model)
    longest_s = max(len(recording) / recording.sample_rate_hz for recording in recordings)
    if fastest * longest_s > MOST_GROWTH:
        yield (
            f"the model is unstable: without a force its motion grows e-fold in {1 / fastest:.3g} s; damping and "
            "stiffness must not be negative"
        )


def _too_fast_modes(model: MechanicalModel, recording: Recording) -> Iterator[str]:
    """A slowest mode above half the sample rate: most likely the rate is stated a thousand times too low."""
    swings_hz = np.abs(free_motion_rates(model).imag) / (2 * np.pi)
    slowest_hz = min((float(swing_hz) for swing_hz in swings_hz if swing_hz > 0), default=0.0)
    if slowest_hz > recording.sample_rate_hz / 2:
        yield (
            f"the model swings at {slowest_hz:.3g} Hz and faster, which cannot be seen at a rate of "
            f"{recording.sample_rate_hz:g} Hz; the recording must state its rate in hertz"
        )


def _find_misplaced_effects(model: MechanicalModel, recording: Recording) -> Iterator[str]:
    try:
        place_recorded_effects(model, recording)
    except PlacingError as problem:
        yield str(problem)
