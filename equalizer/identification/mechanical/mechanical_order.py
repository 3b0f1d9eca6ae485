"""Order selection of a mechanical model by cross-validation: structures grow while the error on held-out lines falls.

Forward selection: from the driven axes alone, the first larger structure is adopted that lowers the squared error on
held-out lines (every fourth line) enough, see `improves_enough`. Candidates are a further mode, sensors that measure
the modes' motion too, a delay, and a rotated sensor. The band is widened in stages. Thresholds are heuristic.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from equalizer.identification.mechanical.mechanical_fit_result import MechanicalFitSettings, OrderTried
from equalizer.identification.mechanical.mechanical_misfit import LineGroup
from equalizer.identification.mechanical.mechanical_mode_start import mode_starts
from equalizer.identification.mechanical.mechanical_refinement import RefinedFit, refine_unknowns
from equalizer.identification.mechanical.mechanical_structure import Structure, remove_mode, start_joint

LEAST_GAIN = 0.08
"""Smallest relative fall of the cross-validated squared error for which a larger structure is adopted; it limits the
order where no linear model fits the device."""
PER_UNKNOWN = 4.0
"""Smallest fall of the squared error per additional unknown, in units of that expected from noise alone."""
REACHED = 1.1
"""Cross-validated rms error, in units of noise and floor (1: all that can be explained), below which growth ends."""
FIRST_STAGE, LEAST_STAGE, STAGE = 6.0, 0.05, 1.5
"""FIRST_STAGE times the band's lower end, but at least LEAST_STAGE of its upper end, is the upper end of the first
stage; STAGE is the largest ratio of the upper ends of consecutive stages."""
CLEAR_DELAY = 4.0
"""Ratio by which additional unknowns of the rigid body (a delay) must reduce the cross-validated squared error."""
SIMPLER = 1.02
"""Largest ratio of the cross-validated squared errors without and with springs to the ground, for omitting these."""
BELOW_JOINT = 0.5
"""Share of the band's upper end up to which a model without the joint is fitted first."""
ALLOWED = (
    "The residual on held-out lines is no larger than the noise, the variation between levels, and the share that no "
    "linear model is expected to explain."
)
"""Reason for the end of growth where the error on held-out lines is below `REACHED`."""
JOINT_BEGUN = (1.1, 1.6)
"""Starting frequencies of the joint's resonance, times the band's upper end."""


def grow_by_stages(
    groups: Sequence[LineGroup],
    best: RefinedFit[Structure],
    band_hz: tuple[float, float],
    settings: MechanicalFitSettings,
    on_progress: Callable[[float], None],
    whole: bool = True,
) -> tuple[RefinedFit[Structure], tuple[OrderTried, ...], str]:
    """Grow a structure while the band is widened upwards, so that lower modes are fitted before higher ones. Returns
    the fit, all structures tried, and the reason for the end. whole: at the full band, a structure with several inputs
    may also get a delay, a sensor rotation and shared sensors."""
    tried = [_record_trial("the driven axes alone", best, best.structure, True)]
    ends = stage_ends(band_hz)
    for number, end in enumerate(ends):
        on_progress(0.9 * number / len(ends))
        band = (band_hz[0], end)
        lower = [part for group in groups if len((part := group.of_lines(group.frequency_hz <= end)).frequency_hz)]
        best = refine_unknowns(lower, best.structure, best.unknowns, band)
        if number == 0 and best.structure.grounded:
            best = _try_without_ground(lower, best, band, tried)
        last = number == len(ends) - 1
        best, reason = _grow_structure(
            lower, best, band, _Limits(settings.most_modes, settings.fit_delay, whole and last), tried
        )
    return best, tuple(tried), reason


@dataclass(frozen=True, slots=True)
class _Limits:
    """Extensions that `_larger_structures` may try."""

    most_modes: int
    fit_delay: bool
    whole_band: bool


def stage_ends(band_hz: tuple[float, float]) -> tuple[float, ...]:
    """Upper ends (Hz) of the growing band, in equal ratios of at most `STAGE`; the last is that of the band."""
    low, high = band_hz
    first = min(high, max(low * FIRST_STAGE, high * LEAST_STAGE))
    count = int(np.ceil(np.log(high / first) / np.log(STAGE))) + 1
    return tuple(float(end) for end in np.geomspace(first, high, count))


def _try_without_ground(
    groups: Sequence[LineGroup], best: RefinedFit[Structure], band_hz: tuple[float, float], tried: list[OrderTried]
) -> RefinedFit[Structure]:
    """The fit without springs to the ground where the error hardly rises (`SIMPLER`), else `best`."""
    structure = replace(best.structure, grounded=False)
    free = refine_unknowns(groups, structure, best.structure.transfer_unknowns(best.unknowns, structure), band_hz)
    simpler = free.left_out <= SIMPLER * best.left_out
    tried.append(_record_trial("without springs to the ground", free, structure, simpler))
    return free if simpler else best


def _grow_structure(
    groups: Sequence[LineGroup],
    best: RefinedFit[Structure],
    band_hz: tuple[float, float],
    limits: "_Limits",
    tried: list[OrderTried],
) -> tuple[RefinedFit[Structure], str]:
    """Adopt larger structures while they improve the fit enough in this band. Returns the fit and the reason for the
    end."""
    while best.error >= REACHED:
        for what, larger in _larger_structures(groups, best, band_hz, limits):
            better = improves_enough(best, larger)
            tried.append(_record_trial(f"{what}, up to {band_hz[1]:.3g} Hz", larger, larger.structure, better))
            if better:
                best = larger
                break
        else:
            full = best.structure.modes >= limits.most_modes
            allowed = f"{limits.most_modes} modes, the most that are allowed, are used, and n" if full else "N"
            return best, (
                f"{allowed}o further term explains {LEAST_GAIN:.0%} of the residual on held-out lines, and more than "
                "noise does."
            )
    return best, ALLOWED


def grow_across_joint(
    groups: Sequence[LineGroup],
    best: RefinedFit[Structure],
    band_hz: tuple[float, float],
    settings: MechanicalFitSettings,
    on_progress: Callable[[float], None],
) -> tuple[RefinedFit[Structure], tuple[OrderTried, ...], str]:
    """Grow a structure with an elastic joint. Oscillators are first found without the joint in the lower half of the
    band, where it has little effect. Returns the fit, all structures tried, and the reason for the end."""
    half = max(BELOW_JOINT * band_hz[1], stage_ends(band_hz)[0])
    lower = [part for group in groups if len((part := group.of_lines(group.frequency_hz <= half)).frequency_hz)]
    below, tried, _ = grow_by_stages(
        lower, best, (band_hz[0], half), settings, lambda s: on_progress(0.5 * s), whole=False
    )
    structure = replace(below.structure, joint=True)
    found = list(tried)
    fits = []
    for number, times in enumerate(JOINT_BEGUN):
        begun = start_joint(structure, below.structure.transfer_unknowns(below.unknowns, structure), times * band_hz[1])
        fits.append(refine_unknowns(groups, structure, begun, band_hz))
        on_progress(0.5 + 0.1 * (number + 1))
        found.append(_record_trial(f"with a joint begun at {times * band_hz[1]:.3g} Hz", fits[-1], structure, True))
    joined = _drop_spare_modes(groups, min(fits, key=lambda each: each.left_out), band_hz, found)
    grown, reason = _grow_structure(
        groups, joined, band_hz, _Limits(settings.most_modes, fit_delay=False, whole_band=False), found
    )
    return grown, tuple(found), reason


def _drop_spare_modes(
    groups: Sequence[LineGroup], now: RefinedFit[Structure], band_hz: tuple[float, float], tried: list[OrderTried]
) -> RefinedFit[Structure]:
    """Remove oscillators that became superfluous with the joint, the last first."""
    for mode in reversed(range(now.structure.modes)):
        fewer, unknowns = remove_mode(now.structure, now.unknowns, mode)
        fit = refine_unknowns(groups, fewer, unknowns, band_hz)
        simpler = not improves_enough(fit, now)
        tried.append(_record_trial(f"without mode {mode + 1}", fit, fewer, simpler))
        now = fit if simpler else now
    return now


def choose_simplest(starts: Sequence[RefinedFit[Structure]]) -> RefinedFit[Structure]:
    """The best fit with the fewest unknowns, unless a fit with more reduces the squared error by `CLEAR_DELAY` or
    more."""
    fewest = min(each.structure.parameters for each in starts)
    best = min((each for each in starts if each.structure.parameters == fewest), key=lambda each: each.left_out)
    richer = min(starts, key=lambda each: each.left_out)
    return richer if CLEAR_DELAY * richer.left_out < best.left_out else best


def improves_enough(now: RefinedFit[Structure], larger: RefinedFit[Structure]) -> bool:
    """Whether the larger structure lowers the squared error on held-out lines by more than LEAST_GAIN of it, and by
    more than PER_UNKNOWN times what its further unknowns gain by chance."""
    gain = now.left_out - larger.left_out
    unknowns = larger.structure.parameters - now.structure.parameters
    by_chance = unknowns * larger.left_out / max(larger.left_out_count, 1)
    return gain > max(LEAST_GAIN * now.left_out, PER_UNKNOWN * by_chance)


def _larger_structures(
    groups: Sequence[LineGroup], now: RefinedFit[Structure], band_hz: tuple[float, float], limits: _Limits
) -> Iterator[tuple[str, RefinedFit[Structure]]]:
    """Fits of structures with a further extension, each with its description: modes first, then the others."""
    structure = now.structure
    starts = mode_starts(groups, now, band_hz) if structure.modes < limits.most_modes else ()
    for start in starts:
        what = f"with a mode begun at {start.frequency_hz:.3g} Hz ({start.structure.modes} in all)"
        yield what, refine_unknowns(groups, start.structure, start.unknowns, band_hz)
    # Couplings between axes are identifiable only once all modes are included.
    if structure.inputs > 1 and not limits.whole_band:
        return
    small: list[tuple[str, Structure]] = []
    if structure.modes and not structure.shared:
        small.append(("with sensors that see the modes too", replace(structure, shared=True)))
    if limits.fit_delay and not structure.delayed:
        small.append(("with a delay", replace(structure, delayed=True)))
    if structure.inputs > 1 and not structure.turned:
        small.append(("with a turned sensor", replace(structure, turned=True)))
    for what, other in small:
        yield what, refine_unknowns(groups, other, structure.transfer_unknowns(now.unknowns, other), band_hz)
    for start in () if structure.shared else starts[:1]:
        other = replace(start.structure, shared=True)
        unknowns = start.structure.transfer_unknowns(start.unknowns, other)
        what = f"with a mode begun at {start.frequency_hz:.3g} Hz that the sensors see ({other.modes} in all)"
        yield what, refine_unknowns(groups, other, unknowns, band_hz)


def _record_trial(what: str, fit: RefinedFit[Structure], structure: Structure, accepted: bool) -> OrderTried:
    return OrderTried(what, structure.coordinates, structure.parameters, fit.error, accepted)
