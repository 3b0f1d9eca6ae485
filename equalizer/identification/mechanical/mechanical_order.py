"""How many coordinates the data need: one more unknown thing is kept while lines that were not fitted gain by it."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from equalizer.identification.mechanical.mechanical_fit_result import MechanicalFitSettings, OrderTried
from equalizer.identification.mechanical.mechanical_misfit import LineGroup
from equalizer.identification.mechanical.mechanical_mode_start import mode_starts
from equalizer.identification.mechanical.mechanical_refinement import Refined, refined
from equalizer.identification.mechanical.mechanical_structure import Structure, begun_joint, without_mode

LEAST_GAIN = 0.08
"""Of the left-out squares: less is not worth a mode on a device that no linear model fits."""
PER_UNKNOWN = 4.0
"""Times what an unknown gains from noise alone, in the mean squares."""
REACHED = 1.1
"""Left-out error in units of what noise and floor expect: nothing more to explain."""
FIRST_STAGE, LEAST_STAGE, STAGE = 6.0, 0.05, 1.5
"""How far the band reaches at first, times its beginning, or of its end; then times the last stage."""
CLEAR_DELAY = 4.0
"""Times smaller must the left-out squares be for a delay to be taken before any mode is."""
SIMPLER = 1.02
"""So much worse may the left-out squares be without springs to the ground."""
BELOW_JOINT = 0.5
"""Of the band: where a joint above it is not looked for yet."""
ALLOWED = (
    "What is left on lines that were not fitted is no more than noise, what differs between levels, and the share that "
    "no linear model is expected to explain."
)
JOINT_BEGUN = (1.1, 1.6)
"""Times the band's end: where its resonance is sought from."""


def by_stages(
    groups: Sequence[LineGroup],
    best: Refined[Structure],
    band_hz: tuple[float, float],
    settings: MechanicalFitSettings,
    on_progress: Callable[[float], None],
    whole: bool = True,
) -> tuple[Refined[Structure], tuple[OrderTried, ...], str]:
    """The band grows upwards, for what is fitted below tells where what lies above begins. whole: at its end also small
    things beside modes are tried."""
    tried = [_tried("the driven axes alone", best, best.structure, True)]
    ends = stages(band_hz)
    for number, end in enumerate(ends):
        on_progress(0.9 * number / len(ends))
        band = (band_hz[0], end)
        lower = [part for group in groups if len((part := group.of(group.frequency_hz <= end)).frequency_hz)]
        best = refined(lower, best.structure, best.unknowns, band)
        if number == 0 and best.structure.grounded:
            best = _without_ground(lower, best, band, tried)
        last = number == len(ends) - 1
        best, reason = _grown(
            lower, best, band, _Limits(settings.most_modes, settings.fit_delay, whole and last), tried
        )
    return best, tuple(tried), reason


@dataclass(frozen=True, slots=True)
class _Limits:
    most_modes: int
    fit_delay: bool
    whole_band: bool


def stages(band_hz: tuple[float, float]) -> tuple[float, ...]:
    """Ends of the growing band, hertz."""
    low, high = band_hz
    first = min(high, max(low * FIRST_STAGE, high * LEAST_STAGE))
    count = int(np.ceil(np.log(high / first) / np.log(STAGE))) + 1
    return tuple(float(end) for end in np.geomspace(first, high, count))


def _without_ground(
    groups: Sequence[LineGroup], best: Refined[Structure], band_hz: tuple[float, float], tried: list[OrderTried]
) -> Refined[Structure]:
    structure = replace(best.structure, grounded=False)
    free = refined(groups, structure, best.structure.carried_over(best.unknowns, structure), band_hz)
    simpler = free.left_out <= SIMPLER * best.left_out
    tried.append(_tried("without springs to the ground", free, structure, simpler))
    return free if simpler else best


def _grown(
    groups: Sequence[LineGroup],
    best: Refined[Structure],
    band_hz: tuple[float, float],
    limits: "_Limits",
    tried: list[OrderTried],
) -> tuple[Refined[Structure], str]:
    """With all that earns its place in this band, and why no more."""
    while best.error >= REACHED:
        for what, larger in _larger(groups, best, band_hz, limits):
            better = earns_its_place(best, larger)
            tried.append(_tried(f"{what}, up to {band_hz[1]:.3g} Hz", larger, larger.structure, better))
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


def across_a_joint(
    groups: Sequence[LineGroup],
    best: Refined[Structure],
    band_hz: tuple[float, float],
    settings: MechanicalFitSettings,
    on_progress: Callable[[float], None],
) -> tuple[Refined[Structure], tuple[OrderTried, ...], str]:
    """Below half of the band a joint hardly shows, and oscillators are found without it."""
    half = max(BELOW_JOINT * band_hz[1], stages(band_hz)[0])
    lower = [part for group in groups if len((part := group.of(group.frequency_hz <= half)).frequency_hz)]
    below, tried, _ = by_stages(lower, best, (band_hz[0], half), settings, lambda s: on_progress(0.5 * s), whole=False)
    structure = replace(below.structure, joint=True)
    found = list(tried)
    fits = []
    for number, times in enumerate(JOINT_BEGUN):
        begun = begun_joint(structure, below.structure.carried_over(below.unknowns, structure), times * band_hz[1])
        fits.append(refined(groups, structure, begun, band_hz))
        on_progress(0.5 + 0.1 * (number + 1))
        found.append(_tried(f"with a joint begun at {times * band_hz[1]:.3g} Hz", fits[-1], structure, True))
    joined = _needed(groups, min(fits, key=lambda each: each.left_out), band_hz, found)
    grown, reason = _grown(
        groups, joined, band_hz, _Limits(settings.most_modes, fit_delay=False, whole_band=False), found
    )
    return grown, tuple(found), reason


def _needed(
    groups: Sequence[LineGroup], now: Refined[Structure], band_hz: tuple[float, float], tried: list[OrderTried]
) -> Refined[Structure]:
    """Without oscillators that stood in for the joint."""
    for mode in reversed(range(now.structure.modes)):
        fewer, unknowns = without_mode(now.structure, now.unknowns, mode)
        fit = refined(groups, fewer, unknowns, band_hz)
        simpler = not earns_its_place(fit, now)
        tried.append(_tried(f"without mode {mode + 1}", fit, fewer, simpler))
        now = fit if simpler else now
    return now


def simplest(starts: Sequence[Refined[Structure]]) -> Refined[Structure]:
    """The best of those with the fewest unknowns, unless more of them earn their place."""
    fewest = min(each.structure.parameters for each in starts)
    best = min((each for each in starts if each.structure.parameters == fewest), key=lambda each: each.left_out)
    richer = min(starts, key=lambda each: each.left_out)
    return richer if CLEAR_DELAY * richer.left_out < best.left_out else best


def earns_its_place(now: Refined[Structure], larger: Refined[Structure]) -> bool:
    gain = now.left_out - larger.left_out
    unknowns = larger.structure.parameters - now.structure.parameters
    by_chance = unknowns * larger.left_out / max(larger.left_out_count, 1)
    return gain > max(LEAST_GAIN * now.left_out, PER_UNKNOWN * by_chance)


def _larger(
    groups: Sequence[LineGroup], now: Refined[Structure], band_hz: tuple[float, float], limits: _Limits
) -> Iterator[tuple[str, Refined[Structure]]]:
    """One thing more, the cheaper ones first."""
    structure = now.structure
    starts = mode_starts(groups, now, band_hz) if structure.modes < limits.most_modes else ()
    for start in starts:
        what = f"with a mode begun at {start.frequency_hz:.3g} Hz ({start.structure.modes} in all)"
        yield what, refined(groups, start.structure, start.unknowns, band_hz)
    if structure.inputs > 1 and not limits.whole_band:  # what is between axes shows once all modes are there
        return
    small: list[tuple[str, Structure]] = []
    if structure.modes and not structure.shared:
        small.append(("with sensors that see the modes too", replace(structure, shared=True)))
    if limits.fit_delay and not structure.delayed:
        small.append(("with a delay", replace(structure, delayed=True)))
    if structure.inputs > 1 and not structure.turned:
        small.append(("with a turned sensor", replace(structure, turned=True)))
    for what, other in small:
        yield what, refined(groups, other, structure.carried_over(now.unknowns, other), band_hz)
    for start in () if structure.shared else starts[:1]:
        other = replace(start.structure, shared=True)
        unknowns = start.structure.carried_over(start.unknowns, other)
        what = f"with a mode begun at {start.frequency_hz:.3g} Hz that the sensors see ({other.modes} in all)"
        yield what, refined(groups, other, unknowns, band_hz)


def _tried(what: str, fit: Refined[Structure], structure: Structure, accepted: bool) -> OrderTried:
    return OrderTried(what, structure.coordinates, structure.parameters, fit.error, accepted)
