"""Order selection of a mechanical model by cross-validation: structures grow while the error on held-out lines falls.

Forward selection: from the driven axes alone, the first larger structure is adopted that lowers the squared error on
held-out lines (every fourth line) enough, see `improves_enough`. Candidates are a further mode, sensors that measure
the modes' motion too, a delay, and a rotated sensor. The band is widened in stages. Thresholds are chosen.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from equalizer.identification.mechanical.mechanical_fit_result import MechanicalFitSettings, OrderCandidate
from equalizer.identification.mechanical.mechanical_misfit import LineGroup
from equalizer.identification.mechanical.mechanical_mode_start import estimate_mode_starts
from equalizer.identification.mechanical.mechanical_refinement import RefinedFit, refine_unknowns
from equalizer.identification.mechanical.mechanical_structure import Structure, remove_mode, start_joint

LEAST_GAIN = 0.08
"""Smallest relative fall of the cross-validated squared error for which a larger structure is adopted; it limits the
order where no linear model fits the device."""
GAIN_PER_UNKNOWN = 4.0
"""Smallest fall of the squared error per additional unknown, in units of the fall expected from noise alone."""
TARGET_ERROR = 1.1
"""Cross-validated rms error, in units of noise and floor (1: all that can be explained), below which growth ends."""
FIRST_STAGE_RATIO, LEAST_FIRST_STAGE_SHARE, STAGE_RATIO = 6.0, 0.05, 1.5
"""Upper end of the first stage, relative to the band's lower end; its least value, relative to the band's upper end;
and the largest ratio of the upper ends of consecutive stages."""
DELAY_RATIO = 4.0
"""Ratio by which additional unknowns of the rigid body (a delay) must reduce the cross-validated squared error."""
SIMPLER_RATIO = 1.02
"""Springs to the ground are omitted up to this ratio of the cross-validated squared errors without and with them."""
JOINT_FREE_SHARE = 0.5
"""Least upper end of the band in which a model without the joint is fitted first, relative to that of the band."""
TARGET_REACHED = (
    "The residual on held-out lines is no larger than the noise, the variation between levels, and the share that no "
    "linear model is expected to explain."
)
"""Reason for the end of growth where the error on held-out lines is below `TARGET_ERROR` (in `modal_order`: below
1)."""
OUT_OF_TIME = "The time limit was reached: further terms were not tried."
"""Reason for the end of growth where no time is left."""
JOINT_START_RATIOS = (1.1, 1.6)
"""Starting frequencies of the joint's resonance, relative to the band's upper end."""


@dataclass(frozen=True, slots=True)
class _Limits:
    """Limits of the extensions that `_fit_extensions` may try."""

    most_modes: int
    """Largest number of modes in addition to the driven axes."""
    fit_delay: bool
    """Whether a delay is tried."""
    extend_couplings: bool
    """Whether a structure with several inputs may get a delay, a sensor rotation and shared sensors."""
    time_left: Callable[[], bool]
    """`MechanicalFitSettings.time_left`."""


def grow_by_stages(
    groups: Sequence[LineGroup],
    best: RefinedFit[Structure],
    band_hz: tuple[float, float],
    settings: MechanicalFitSettings,
    on_progress: Callable[[float], None],
    extend_couplings: bool = True,
) -> tuple[RefinedFit[Structure], tuple[OrderCandidate, ...], str]:
    """Grow a structure while the band is widened upwards, so that lower modes are fitted before higher ones. Returns
    the fit, all structures tried, and the reason for the end. extend_couplings: whether, in the last stage, a structure
    with several inputs may also get a delay, a sensor rotation and shared sensors."""
    trials = [_record_trial("the driven axes alone", best, best.structure, True)]
    upper_ends_hz = compute_stage_ends(band_hz)
    for stage, upper_hz in enumerate(upper_ends_hz):
        on_progress(0.9 * stage / len(upper_ends_hz))
        if not settings.time_left():
            return best, tuple(trials), OUT_OF_TIME
        stage_band_hz = (band_hz[0], upper_hz)
        lower_groups = [
            part for group in groups if len((part := group.select_lines(group.frequency_hz <= upper_hz)).frequency_hz)
        ]
        best = refine_unknowns(lower_groups, best.structure, best.unknowns, stage_band_hz)
        if stage == 0 and best.structure.grounded:
            best = _try_without_ground(lower_groups, best, stage_band_hz, trials)
        is_last = stage == len(upper_ends_hz) - 1
        best, reason = _grow_structure(
            lower_groups,
            best,
            stage_band_hz,
            _Limits(settings.most_modes, settings.fit_delay, extend_couplings and is_last, settings.time_left),
            trials,
        )
    return best, tuple(trials), reason


def compute_stage_ends(band_hz: tuple[float, float]) -> tuple[float, ...]:
    """Compute the upper ends (Hz) of the growing band, in equal ratios of at most `STAGE_RATIO`; the last is that of
    the band."""
    lowest_hz, highest_hz = band_hz
    first_end_hz = min(highest_hz, max(lowest_hz * FIRST_STAGE_RATIO, highest_hz * LEAST_FIRST_STAGE_SHARE))
    stage_count = int(np.ceil(np.log(highest_hz / first_end_hz) / np.log(STAGE_RATIO))) + 1
    return tuple(float(end) for end in np.geomspace(first_end_hz, highest_hz, stage_count))


def _try_without_ground(
    groups: Sequence[LineGroup], best: RefinedFit[Structure], band_hz: tuple[float, float], trials: list[OrderCandidate]
) -> RefinedFit[Structure]:
    """Fit without springs to the ground; return that fit if the squared error rises by a factor of at most
    `SIMPLER_RATIO`, else `best`. The trial is recorded in `trials`."""
    structure = replace(best.structure, grounded=False)
    ungrounded_fit = refine_unknowns(
        groups, structure, best.structure.convert_unknowns(best.unknowns, structure), band_hz
    )
    is_simpler = ungrounded_fit.held_out_squares <= SIMPLER_RATIO * best.held_out_squares
    trials.append(_record_trial("without springs to the ground", ungrounded_fit, structure, is_simpler))
    return ungrounded_fit if is_simpler else best


def _grow_structure(
    groups: Sequence[LineGroup],
    best: RefinedFit[Structure],
    band_hz: tuple[float, float],
    limits: _Limits,
    trials: list[OrderCandidate],
) -> tuple[RefinedFit[Structure], str]:
    """Adopt larger structures while they improve the fit enough in this band, and record all trials in `trials`.
    Returns the fit and the reason for the end."""
    while best.error >= TARGET_ERROR:
        for description, extended_fit in _fit_extensions(groups, best, band_hz, limits):
            is_accepted = improves_enough(best, extended_fit)
            trials.append(
                _record_trial(
                    f"{description}, up to {band_hz[1]:.3g} Hz", extended_fit, extended_fit.structure, is_accepted
                )
            )
            if is_accepted:
                best = extended_fit
                break
        else:
            if not limits.time_left():
                return best, OUT_OF_TIME
            is_full = best.structure.modes >= limits.most_modes
            prefix = f"{limits.most_modes} modes, the most that are allowed, are used, and n" if is_full else "N"
            return best, (
                f"{prefix}o further term explains {LEAST_GAIN:.0%} of the residual on held-out lines, and more than "
                "noise does."
            )
    return best, TARGET_REACHED


def grow_across_joint(
    groups: Sequence[LineGroup],
    best: RefinedFit[Structure],
    band_hz: tuple[float, float],
    settings: MechanicalFitSettings,
    on_progress: Callable[[float], None],
) -> tuple[RefinedFit[Structure], tuple[OrderCandidate, ...], str]:
    """Grow a structure with an elastic joint. Oscillators are first fitted without the joint in the lower part of the
    band (`JOINT_FREE_SHARE`), where it has little effect. Returns as `grow_by_stages`."""
    end_hz = max(JOINT_FREE_SHARE * band_hz[1], compute_stage_ends(band_hz)[0])
    low_groups = [
        part for group in groups if len((part := group.select_lines(group.frequency_hz <= end_hz)).frequency_hz)
    ]
    without_joint, stage_trials, _ = grow_by_stages(
        low_groups, best, (band_hz[0], end_hz), settings, lambda share: on_progress(0.5 * share), extend_couplings=False
    )
    structure = replace(without_joint.structure, joint=True)
    trials = list(stage_trials)
    fits = []
    for number, start_ratio in enumerate(JOINT_START_RATIOS):
        start = start_joint(
            structure,
            without_joint.structure.convert_unknowns(without_joint.unknowns, structure),
            start_ratio * band_hz[1],
        )
        fits.append(refine_unknowns(groups, structure, start, band_hz))
        on_progress(0.5 + 0.1 * (number + 1))
        trials.append(
            _record_trial(f"with a joint begun at {start_ratio * band_hz[1]:.3g} Hz", fits[-1], structure, True)
        )
    with_joint = _remove_superfluous_modes(groups, min(fits, key=lambda fit: fit.held_out_squares), band_hz, trials)
    final, reason = _grow_structure(
        groups,
        with_joint,
        band_hz,
        _Limits(settings.most_modes, False, False, settings.time_left),
        trials,
    )
    return final, tuple(trials), reason


def _remove_superfluous_modes(
    groups: Sequence[LineGroup],
    current: RefinedFit[Structure],
    band_hz: tuple[float, float],
    trials: list[OrderCandidate],
) -> RefinedFit[Structure]:
    """Remove oscillators, the last first, whose addition would not pass `improves_enough`; record the trials."""
    for mode in reversed(range(current.structure.modes)):
        smaller_structure, unknowns = remove_mode(current.structure, current.unknowns, mode)
        fit = refine_unknowns(groups, smaller_structure, unknowns, band_hz)
        is_simpler = not improves_enough(fit, current)
        trials.append(_record_trial(f"without mode {mode + 1}", fit, smaller_structure, is_simpler))
        current = fit if is_simpler else current
    return current


def choose_simplest(starts: Sequence[RefinedFit[Structure]]) -> RefinedFit[Structure]:
    """Choose the best fit with the fewest unknowns, unless a fit with more reduces the squared error by more than the
    factor `DELAY_RATIO`."""
    fewest_unknowns = min(start.structure.parameters for start in starts)
    simplest = min(
        (start for start in starts if start.structure.parameters == fewest_unknowns),
        key=lambda start: start.held_out_squares,
    )
    best = min(starts, key=lambda start: start.held_out_squares)
    return best if DELAY_RATIO * best.held_out_squares < simplest.held_out_squares else simplest


def improves_enough(current: RefinedFit[Structure], extended_fit: RefinedFit[Structure]) -> bool:
    """Whether the larger structure lowers the squared error on held-out lines by more than LEAST_GAIN of it, and by
    more than GAIN_PER_UNKNOWN times what its further unknowns gain by chance."""
    gain = current.held_out_squares - extended_fit.held_out_squares
    added_unknowns = extended_fit.structure.parameters - current.structure.parameters
    chance_gain = added_unknowns * extended_fit.held_out_squares / max(extended_fit.held_out_count, 1)
    return gain > max(LEAST_GAIN * current.held_out_squares, GAIN_PER_UNKNOWN * chance_gain)


def _fit_extensions(
    groups: Sequence[LineGroup], current: RefinedFit[Structure], band_hz: tuple[float, float], limits: _Limits
) -> Iterator[tuple[str, RefinedFit[Structure]]]:
    """Fit extended structures, each with its description: with a further mode, then with another extension, last with a
    mode and shared sensors together."""
    structure = current.structure
    may_add_mode = structure.modes < limits.most_modes and limits.time_left()
    starts = estimate_mode_starts(groups, current, band_hz) if may_add_mode else ()
    for start in starts:
        if not limits.time_left():
            return
        description = f"with a mode begun at {start.frequency_hz:.3g} Hz ({start.structure.modes} in all)"
        yield description, refine_unknowns(groups, start.structure, start.unknowns, band_hz)
    # Couplings between axes are identifiable only once all modes are included.
    if structure.inputs > 1 and not limits.extend_couplings:
        return
    extensions: list[tuple[str, Structure]] = []
    if structure.modes and not structure.shared_sensors:
        extensions.append(("with sensors that see the modes too", replace(structure, shared_sensors=True)))
    if limits.fit_delay and not structure.delayed:
        extensions.append(("with a delay", replace(structure, delayed=True)))
    if structure.inputs > 1 and not structure.rotated_sensor:
        extensions.append(("with a turned sensor", replace(structure, rotated_sensor=True)))
    for description, extended in extensions:
        if not limits.time_left():
            return
        yield (
            description,
            refine_unknowns(groups, extended, structure.convert_unknowns(current.unknowns, extended), band_hz),
        )
    for start in () if structure.shared_sensors or not limits.time_left() else starts[:1]:
        extended = replace(start.structure, shared_sensors=True)
        unknowns = start.structure.convert_unknowns(start.unknowns, extended)
        description = f"with a mode begun at {start.frequency_hz:.3g} Hz that the sensors see ({extended.modes} in all)"
        yield description, refine_unknowns(groups, extended, unknowns, band_hz)


def _record_trial(description: str, fit: RefinedFit[Structure], structure: Structure, accepted: bool) -> OrderCandidate:
    """Record a trial as an entry of the result. accepted: whether the structure was adopted; true for both starts of a
    joint."""
    return OrderCandidate(description, structure.coordinates, structure.parameters, fit.error, accepted)
