"""How many coordinates the data need: one more unknown thing is kept while lines that were not fitted gain by it."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from equalizer.identification.mechanical_fit_result import MechanicalFitSettings, OrderTried
from equalizer.identification.mechanical_misfit import LineGroup
from equalizer.identification.mechanical_refinement import Refined, refined
from equalizer.identification.mechanical_start import mode_starts

LEAST_GAIN = 0.08
"""Of the left-out squares: less is not worth a mode on a device that no linear model fits."""
PER_UNKNOWN = 4.0
"""Times what an unknown gains from noise alone, in the mean squares."""
REACHED = 1.1
"""Left-out error in units of what noise and floor expect: nothing more to explain."""
SIMPLER = 1.02
"""So much worse may the left-out squares be without springs to the ground."""


@dataclass(frozen=True, slots=True, eq=False)
class Chosen:
    best: Refined
    tried: tuple[OrderTried, ...]
    reason: str


def choose(
    groups: Sequence[LineGroup],
    starts: Sequence[Refined],
    band_hz: tuple[float, float],
    settings: MechanicalFitSettings,
    on_progress: Callable[[float], None],
) -> Chosen:
    """starts: fits of the driven axes alone, from several beginnings."""
    best = min(starts, key=lambda each: each.squares)
    tried = [_tried("the driven axes alone", best, True)]
    if best.structure.grounded:
        structure, unknowns = best.structure.larger(best.unknowns, grounded=False)
        free = refined(groups, structure, unknowns, band_hz)
        simpler = free.left_out <= SIMPLER * best.left_out
        tried.append(_tried("without springs to the ground", free, simpler))
        best = free if simpler else best
    reason = f"{settings.most_modes} modes, the most that were allowed, were used."
    settled = False
    while not settled and best.structure.modes <= settings.most_modes:
        on_progress(min(0.9, 0.1 + 0.8 * best.structure.modes / max(settings.most_modes, 1)))
        if best.error < REACHED:
            reason = "What is left on lines that were not fitted is what noise allows."
            break
        settled = True
        for what, larger in _larger(groups, best, band_hz, settings):
            better = _earns_its_place(best, larger)
            tried.append(_tried(what, larger, better))
            if better:
                best, settled = larger, False
                break
        else:
            reason = (
                f"Nothing more explains {LEAST_GAIN:.0%} of what is left on lines that were not fitted, and more than "
                "noise does."
            )
    return Chosen(best, tuple(tried), reason)


def _earns_its_place(now: Refined, larger: Refined) -> bool:
    gain = now.left_out - larger.left_out
    unknowns = larger.structure.parameters - now.structure.parameters
    by_chance = unknowns * larger.left_out / max(larger.left_out_count, 1)
    return gain > max(LEAST_GAIN * now.left_out, PER_UNKNOWN * by_chance)


def _larger(
    groups: Sequence[LineGroup], now: Refined, band_hz: tuple[float, float], settings: MechanicalFitSettings
) -> Iterator[tuple[str, Refined]]:
    """One thing more, the cheaper ones first."""
    structure = now.structure
    small: list[tuple[str, dict[str, bool | int]]] = []
    if settings.fit_delay and not structure.delayed:
        small.append(("with a delay", {"delayed": True}))
    if structure.inputs > 1 and not structure.turned:
        small.append(("with a turned sensor", {"turned": True}))
    if structure.modes and not structure.shared:
        small.append(("with sensors that see the modes too", {"shared": True}))
    for what, changes in small:
        other, unknowns = structure.larger(now.unknowns, **changes)
        yield what, refined(groups, other, unknowns, band_hz)
    if structure.modes < settings.most_modes:
        for start in mode_starts(groups, now, band_hz):
            what = f"with a mode begun at {start.frequency_hz:.3g} Hz ({start.structure.modes} in all)"
            yield what, refined(groups, start.structure, start.unknowns, band_hz)


def _tried(what: str, fit: Refined, accepted: bool) -> OrderTried:
    return OrderTried(what, fit.structure.coordinates, fit.structure.parameters, fit.error, accepted)
