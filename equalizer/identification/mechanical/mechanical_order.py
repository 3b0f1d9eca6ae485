"""Order selection of a mechanical model: structures grow while the error on held-out lines falls."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from equalizer.identification.mechanical.mechanical_fit_result import MechanicalFitSettings, OrderTried
from equalizer.identification.mechanical.mechanical_misfit import LineGroup
from equalizer.identification.mechanical.mechanical_mode_start import mode_starts
from equalizer.identification.mechanical.mechanical_refinement import RefinedFit, refine_unknowns
from equalizer.identification.mechanical.mechanical_structure import Structure, remove_mode, start_joint

LEAST_GAIN = 0.08
"""Smallest relative fall of the cross-validated squared error that a mode must bring where no linear model fits the
device."""
PER_UNKNOWN = 4.0
"""Smallest gain per unknown, in units of that from noise alone."""
REACHED = 1.1
"""Cross-validated error, in units of noise and floor, at which nothing is left to explain."""
FIRST_STAGE, LEAST_STAGE, STAGE = 6.0, 0.05, 1.5
"""Upper end of the first stage: times the band's lower end, but at least this share of its upper end; then the ratio
from stage to stage."""
CLEAR_DELAY = 4.0
"""Ratio by which a delay must reduce the cross-validated squared error to be added before any mode."""
SIMPLER = 1.02
"""Ratio by which the cross-validated squared error may rise without springs to the ground."""
BELOW_JOINT = 0.5
"""Share of the band up to which a joint is not yet included."""
ALLOWED = (
    "What is left on lines that were not fitted is no more than noise, what differs between levels, and the share that "
    "no linear model is expected to explain."
)
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
    """Grow a structure while the band is widened upwards, so that modes below are fitted before those above. whole: at
    the full band, delay, sensor rotation and sensor shapes are tried too."""
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
    most_modes: int
    fit_delay: bool
    whole_band: bool


def stage_ends(band_hz: tuple[float, float]) -> tuple[float, ...]:
    """Upper ends of the growing band in hertz."""
    low, high = band_hz
    first = min(high, max(low * FIRST_STAGE, high * LEAST_STAGE))
    count = int(np.ceil(np.log(high / first) / np.log(STAGE))) + 1
    return tuple(float(end) for end in np.geomspace(first, high, count))


def _try_without_ground(
    groups: Sequence[LineGroup], best: RefinedFit[Structure], band_hz: tuple[float, float], tried: list[OrderTried]
) -> RefinedFit[Structure]:
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
    """Add to a structure every part that improves it enough in this band; returns the fit, and why it ended there."""
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
                f"{allowed}othing more explains {LEAST_GAIN:.0%} of what is left on lines that were not fitted, and "
                "more than noise does."
            )
    return best, ALLOWED


def grow_across_joint(
    groups: Sequence[LineGroup],
    best: RefinedFit[Structure],
    band_hz: tuple[float, float],
    settings: MechanicalFitSettings,
    on_progress: Callable[[float], None],
) -> tuple[RefinedFit[Structure], tuple[OrderTried, ...], str]:
    """Grow a structure with an elastic joint: oscillators are found without it in the lower half of the band, where it
    hardly shows."""
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
    """Remove oscillators that had substituted the joint."""
    for mode in reversed(range(now.structure.modes)):
        fewer, unknowns = remove_mode(now.structure, now.unknowns, mode)
        fit = refine_unknowns(groups, fewer, unknowns, band_hz)
        simpler = not improves_enough(fit, now)
        tried.append(_record_trial(f"without mode {mode + 1}", fit, fewer, simpler))
        now = fit if simpler else now
    return now


def choose_simplest(starts: Sequence[RefinedFit[Structure]]) -> RefinedFit[Structure]:
    """The best fit of those with the fewest unknowns, unless more unknowns reduce the error clearly."""
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
    """Fits of structures with one extension more, the cheaper ones first."""
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
