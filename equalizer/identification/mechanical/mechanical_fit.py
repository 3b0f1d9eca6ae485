"""Fit of a linear mechanical model to recordings, in the frequency domain.

M a + B v + K x = command: masses, dampers and springs at the driven axes, and as many oscillators on them (modes) as
the data support. Steps of `fit_mechanical_model`:

1. spectra of the segments to fit and to test (`mechanical_lines`), grouped by line (`mechanical_misfit`);
2. a rigid body at the driven axes, fitted to the lowest band from several initial values (`mechanical_start`);
3. modes are added one by one while the cross-validated error falls (`mechanical_order`); where sensors are not
   collocated with the commands, modes with free shapes at the sensors are tried (`modal_order`);
4. the chosen structure is fitted to all lines, and simulated on the segments that were kept for the test.

a, v and x are acceleration, velocity and position (n,) of the coordinates; command in N or N m.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from equalizer.identification.mechanical.mechanical_fit_result import (
    ChannelError,
    MechanicalFit,
    MechanicalFitError,
    MechanicalFitSettings,
    OrderCandidate,
)
from equalizer.identification.mechanical.mechanical_free_simulation import compute_simulation_errors
from equalizer.identification.mechanical.mechanical_lines import (
    SegmentLines,
    compute_all_lines,
    select_band,
    split_fit_and_test,
)
from equalizer.identification.mechanical.mechanical_misfit import LineGroup, build_line_groups
from equalizer.identification.mechanical.mechanical_order import (
    LEAST_GAIN,
    choose_simplest,
    compute_stage_ends,
    grow_across_joint,
    grow_by_stages,
)
from equalizer.identification.mechanical.mechanical_refinement import RefinedFit, refine_unknowns
from equalizer.identification.mechanical.mechanical_refusals import refuse_noise, refuse_unstable, refuse_unsuitable
from equalizer.identification.mechanical.mechanical_start import estimate_rigid_starts
from equalizer.identification.mechanical.mechanical_structure import Structure
from equalizer.identification.mechanical.modal_order import balance_fit, choose_modes
from equalizer.identification.mechanical.modal_structure import ModalStructure
from equalizer.identification.mechanical.physical_model import make_physical_model
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.isolated_samples import interpolate_all
from equalizer.signals.recording import Recording
from equalizer.signals.unit_system import find_unit_system

NONCOLLOCATED_ERROR = 1.1
"""Cross-validated error, in units of noise and floor (1: all that can be explained), from which sensors that are not
collocated with the commands are considered. Chosen heuristically."""


@dataclass(frozen=True, slots=True, eq=False)
class StructureChoice:
    """The chosen structure, with sensors collocated with the commands or elsewhere."""

    best: RefinedFit[Structure] | RefinedFit[ModalStructure]
    candidates: tuple[OrderCandidate, ...]
    """All structures that were tried, with their errors."""
    reason: str
    """Reason for the choice, as a sentence."""


def choose_structure(
    groups: Sequence[LineGroup],
    starts: Sequence[RefinedFit[Structure]],
    band_hz: tuple[float, float],
    settings: MechanicalFitSettings,
    on_progress: Callable[[float], None],
) -> StructureChoice:
    """Choose oscillators on the driven axes if they explain the lines, else a structure for sensors elsewhere
    (`_fit_noncollocated_sensors`) if it explains more. `settings.joint` requires an elastic joint, and
    `settings.noncollocated_sensors` one of the two kinds.

    groups: lines of the segments to fit. starts: fits of the driven axes alone up to the first of `compute_stage_ends`,
    from several initial values. on_progress: called with the share done, 0 to 1.
    """
    best = choose_simplest(starts)
    if settings.joint:
        return StructureChoice(*grow_across_joint(groups, best, band_hz, settings, on_progress))
    if settings.noncollocated_sensors:
        return _fit_noncollocated_sensors(groups, best, band_hz, settings, on_progress)
    collocated = StructureChoice(*grow_by_stages(groups, best, band_hz, settings, lambda share: on_progress(share / 2)))
    is_decided = settings.noncollocated_sensors is False or not settings.time_left()
    if collocated.best.error < NONCOLLOCATED_ERROR or is_decided:
        return collocated
    noncollocated = _fit_noncollocated_sensors(
        groups, best, band_hz, settings, lambda share: on_progress(0.5 + share / 2)
    )
    candidates = (
        *collocated.candidates,
        *(replace(trial, description=f"sensors elsewhere: {trial.description}") for trial in noncollocated.candidates),
    )
    prefers_noncollocated = noncollocated.best.held_out_squares < (1 - LEAST_GAIN) * collocated.best.held_out_squares
    return replace(noncollocated if prefers_noncollocated else collocated, candidates=candidates)


def _fit_noncollocated_sensors(
    groups: Sequence[LineGroup],
    best: RefinedFit[Structure],
    band_hz: tuple[float, float],
    settings: MechanicalFitSettings,
    on_progress: Callable[[float], None],
) -> StructureChoice:
    """Fit a structure for sensors that are not collocated with the commands: modes with free shapes or, where a group
    contains a transient, which `choose_modes` cannot fit, oscillators whose motion the driven axes' own sensors measure
    too."""
    if not any(group.transient for group in groups):
        return StructureChoice(*choose_modes(groups, best.structure, band_hz, settings, on_progress))
    structure = replace(best.structure, shared_sensors=True)
    start = replace(best, structure=structure, unknowns=best.structure.convert_unknowns(best.unknowns, structure))
    return StructureChoice(*grow_by_stages(groups, start, band_hz, settings, on_progress))


LINES_PER_GROUP, LINES_IN_ALL = 400, 1600
"""Largest number of lines of each group, and of all groups together, while structures are searched, to limit computing
time; the chosen structure is then fitted to all lines. Chosen."""
_MIN_LINES = 8
"""Smallest number of driven lines from which a model is fitted; times the number of axes where a part of the band is
used. Chosen."""
_BAND_SHARES = (0.25, 0.5, 1.0)
"""Parts of the first stage's band, from its lower end and as shares of its octaves, to which the rigid body is fitted:
a mode at higher frequencies would bias it. Chosen."""


def fit_mechanical_model(
    recordings: Recording | Sequence[Recording],
    settings: MechanicalFitSettings | None = None,
    on_progress: Callable[[float], None] = lambda share: None,
    name: str = "fitted to recordings",
) -> MechanicalFit:
    """Fit a model from the total command to the response.

    Response i should be the motion at the point and in the direction of command i (else see
    `MechanicalFitSettings.noncollocated_sensors`); further responses may be at any place. on_progress: called with the
    share done, 0 to 1. Raises MechanicalFitError where the recordings do not determine a model: unsuitable channels,
    too few driven lines, only noise, or an unstable fit; MechanicalModelError and LinAlgError
    where a starting point is no valid model (`refine_unknowns`).
    """
    recordings = (recordings,) if isinstance(recordings, Recording) else tuple(recordings)
    settings = settings or MechanicalFitSettings()
    refuse_unsuitable(recordings)
    recordings, interpolation_remarks = interpolate_all(recordings)
    fit_segments, test_segments = split_fit_and_test(recordings)
    fit_lines = compute_all_lines(fit_segments)
    segments = select_band(fit_lines, settings.band_hz)
    band_hz = _find_covered_band(segments)
    groups = build_line_groups(segments, settings.floor)
    structure = _make_rigid_structure(recordings[0], settings, band_hz)
    thinned_groups = [group.limit_lines(min(LINES_PER_GROUP, -(-LINES_IN_ALL // len(groups)))) for group in groups]
    starts = _fit_rigid_starts(segments, thinned_groups, structure, band_hz, settings)
    choice = choose_structure(thinned_groups, starts, band_hz, settings, on_progress)
    full_groups = [group.select_lines(np.ones(len(group.frequency_hz), dtype=bool)) for group in groups]
    final = _refit(_include_all_lines(full_groups), choice.best, band_hz, settings.time_left())
    refuse_unstable(final)
    test_lines = compute_all_lines(test_segments)
    on_progress(1.0)
    model = replace(make_physical_model(final, name), units=find_unit_system(recordings[0]))
    errors = _compute_channel_errors(model, fit_lines, test_lines, band_hz, recordings[0].response.channels)
    return MechanicalFit(
        model=model,
        errors=errors[:-1],
        error=errors[-1].fit,
        held_out=errors[-1].held_out,
        noise=errors[-1].noise,
        band_hz=band_hz,
        candidates=choice.candidates,
        reason=choice.reason,
        remarks=(*_list_remarks(final, recordings[0].response.channels, bool(test_lines)), *interpolation_remarks),
    )


def _compute_channel_errors(
    model: MechanicalModel,
    fit_lines: Sequence[SegmentLines],
    test_lines: Sequence[SegmentLines],
    band_hz: tuple[float, float],
    channels: tuple[str, ...],
) -> tuple[ChannelError, ...]:
    """Compute the errors per channel, and over all channels as last entry. Raises MechanicalFitError where no channel
    is explained (`refuse_noise`)."""
    error, noise = compute_simulation_errors(model, fit_lines, band_hz)
    refuse_noise(error, channels)
    test_error = compute_simulation_errors(model, test_lines, band_hz)[0] if test_lines else None
    return tuple(
        ChannelError(
            channel,
            float(error[index]),
            None if test_error is None else float(test_error[index]),
            float(noise[index]) if np.isfinite(noise[index]) else None,
        )
        for index, channel in enumerate((*channels, "all"))
    )


def _fit_rigid_starts(
    segments: Sequence[SegmentLines],
    groups: Sequence[LineGroup],
    structure: Structure,
    band_hz: tuple[float, float],
    settings: MechanicalFitSettings,
) -> list[RefinedFit[Structure]]:
    """Fit a rigid body at the driven axes up to the end of the first stage, once for each initial value: from growing
    parts of that band that hold enough lines, without and, with `settings.fit_delay`, with a delay."""
    fits: list[RefinedFit[Structure]] = []
    stage_end_hz = compute_stage_ends(band_hz)[0]
    stage_groups = [
        part for group in groups if len((part := group.select_lines(group.frequency_hz <= stage_end_hz)).frequency_hz)
    ]
    part_ends_hz = [band_hz[0] * (stage_end_hz / band_hz[0]) ** share for share in _BAND_SHARES]
    for end_hz in (*part_ends_hz, band_hz[1]):
        if fits and not settings.time_left():
            break
        low_segments = select_band(segments, (band_hz[0], end_hz))
        line_count = sum(len(segment.frequency_hz) for segment in low_segments)
        if line_count < _MIN_LINES * structure.inputs and (fits or end_hz < part_ends_hz[-1]):
            continue
        for delayed in (False, True)[: 1 + settings.fit_delay]:
            rigid_starts = estimate_rigid_starts(low_segments, replace(structure, delayed=delayed), settings.floor)
            fits += (refine_unknowns(stage_groups, *start, (band_hz[0], stage_end_hz)) for start in rigid_starts)
    return fits


def _make_rigid_structure(
    recording: Recording, settings: MechanicalFitSettings, band_hz: tuple[float, float]
) -> Structure:
    """Make the structure without modes; its speed scale (rad/s) is 2 pi times the geometric mean of the band's ends
    (Hz)."""
    input_count, output_count = len(recording.command.channels), len(recording.response.channels)
    return Structure(
        inputs=input_count,
        outputs=output_count,
        quantity=recording.response.quantities[0],
        mass_scale=1.0,
        speed_scale=2 * np.pi * float(np.sqrt(band_hz[0] * band_hz[1])),
        signs=(1.0,) * input_count,
        step_s=1 / recording.sample_rate_hz,
        sensor=settings.sensor,
        actuator=settings.actuator,
        grounded=settings.grounded,
        rotational=recording.is_rotational,
    )


def _find_covered_band(segments: Sequence[SegmentLines]) -> tuple[float, float]:
    """Find the frequencies (Hz) of the lowest and the highest line of all segments. Raises MechanicalFitError where
    they have fewer than `_MIN_LINES`."""
    if sum(len(segment.frequency_hz) for segment in segments) < _MIN_LINES:
        raise MechanicalFitError(
            "the commands drive fewer than eight lines in the band: they are constant, or the recording is too short; "
            "record a sweep, noise or a multisine along every axis"
        )
    return (
        float(min(segment.frequency_hz[0] for segment in segments)),
        float(max(segment.frequency_hz[-1] for segment in segments)),
    )


def _refit(
    groups: Sequence[LineGroup],
    best: RefinedFit[Structure] | RefinedFit[ModalStructure],
    band_hz: tuple[float, float],
    has_time_left: bool,
) -> RefinedFit[Structure] | RefinedFit[ModalStructure]:
    """Fit the chosen structure to all lines, from the parameters of the search. Modes with free shapes, which the
    search has refined, and any structure after the time limit take at most 6 evaluations (chosen)."""
    if isinstance(best.structure, ModalStructure):
        return balance_fit(refine_unknowns(groups, best.structure, best.unknowns, band_hz, max_evaluations=6))
    return refine_unknowns(groups, best.structure, best.unknowns, band_hz, 40 if has_time_left else 6)


def _include_all_lines(groups: Sequence[LineGroup]) -> list[LineGroup]:
    """Mark no line of the groups as held out for cross-validation, so that a fit uses all lines."""
    return [replace(group, held_out=np.zeros(len(group.held_out), dtype=bool)) for group in groups]


def _list_remarks(
    final: RefinedFit[Structure] | RefinedFit[ModalStructure], channels: tuple[str, ...], has_test: bool
) -> tuple[str, ...]:
    """List sentences on what was assumed and what the fit shows. has_test: whether segments were kept for the test."""
    structure = final.structure
    collocated = ", ".join(channels[: structure.inputs])
    remarks = [
        f"No model was given, so a linear one was fitted, with {collocated} assumed to move as the commands act."
    ]
    if isinstance(structure, ModalStructure):
        remarks.append("The sensors are not where the commands act on the modes: a joint or cable lies between.")
    elif -1.0 in structure.signs:
        remarks.append("The response is positive in the direction opposite to the command.")
    if isinstance(structure, Structure) and not structure.grounded:
        remarks.append("No spring to the ground was found: the device drifts under a constant command.")
    if not has_test:
        remarks.append("No segment was kept for a test: the error is that of the fitted segments.")
    return tuple(remarks)
