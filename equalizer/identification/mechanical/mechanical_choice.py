"""Which kind of structure: sensors that move with what the commands push, or sensors elsewhere."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from equalizer.identification.mechanical.mechanical_fit_result import MechanicalFitSettings, OrderTried
from equalizer.identification.mechanical.mechanical_misfit import LineGroup
from equalizer.identification.mechanical.mechanical_order import LEAST_GAIN, across_a_joint, by_stages, simplest
from equalizer.identification.mechanical.mechanical_refinement import Refined
from equalizer.identification.mechanical.mechanical_structure import Structure
from equalizer.identification.mechanical.modal_order import choose_modes
from equalizer.identification.mechanical.modal_structure import ModalStructure

ELSEWHERE = 1.1
"""Left-out error, in units of what noise and floor expect, from which on sensors may sit elsewhere."""


@dataclass(frozen=True, slots=True, eq=False)
class Chosen:
    best: Refined[Structure] | Refined[ModalStructure]
    tried: tuple[OrderTried, ...]
    reason: str


def choose(
    groups: Sequence[LineGroup],
    starts: Sequence[Refined[Structure]],
    band_hz: tuple[float, float],
    settings: MechanicalFitSettings,
    on_progress: Callable[[float], None],
) -> Chosen:
    """Oscillators on the driven axes, if they explain the lines; else what sees each mode in a way of its own, if that
    explains more. starts: fits of the driven axes alone to the first of `stages`, from several beginnings."""
    best = simplest(starts)
    if settings.joint:
        return Chosen(*across_a_joint(groups, best, band_hz, settings, on_progress))
    if settings.sensors_elsewhere:
        return _elsewhere(groups, best, band_hz, settings, on_progress)
    here = Chosen(*by_stages(groups, best, band_hz, settings, lambda share: on_progress(share / 2)))
    if here.best.error < ELSEWHERE or settings.sensors_elsewhere is False:
        return here
    other = _elsewhere(groups, best, band_hz, settings, lambda share: on_progress(0.5 + share / 2))
    tried = (*here.tried, *(replace(each, what=f"sensors elsewhere: {each.what}") for each in other.tried))
    better = other.best.left_out < (1 - LEAST_GAIN) * here.best.left_out
    return replace(other if better else here, tried=tried)


def _elsewhere(
    groups: Sequence[LineGroup],
    best: Refined[Structure],
    band_hz: tuple[float, float],
    settings: MechanicalFitSettings,
    on_progress: Callable[[float], None],
) -> Chosen:
    if not any(group.transient for group in groups):
        return Chosen(*choose_modes(groups, best.structure, band_hz, settings, on_progress))
    structure = replace(best.structure, shared=True)
    begun = replace(best, structure=structure, unknowns=best.structure.carried_over(best.unknowns, structure))
    return Chosen(*by_stages(groups, begun, band_hz, settings, on_progress))
