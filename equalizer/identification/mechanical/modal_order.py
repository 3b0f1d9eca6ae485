"""How many modes with shapes of their own the data need, where sensors move otherwise than what the commands push."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from equalizer.identification.mechanical.mechanical_fit_result import MechanicalFitSettings, OrderTried
from equalizer.identification.mechanical.mechanical_misfit import LineGroup
from equalizer.identification.mechanical.mechanical_order import ALLOWED
from equalizer.identification.mechanical.mechanical_refinement import Refined, refined
from equalizer.identification.mechanical.mechanical_structure import Structure
from equalizer.identification.mechanical.modal_search import FoundModes, ModalSearch
from equalizer.identification.mechanical.modal_structure import ModalStructure, balanced
from equalizer.signals.signal import FloatArray

LEAST_GAIN = 0.08
"""Of the left-out squares, by one more frequency with all its shapes."""
REACHED = 1.02
"""Left-out error in units of what noise and floor expect."""
ALIKE = 1.1
"""So much worse may the left-out squares be with fewer modes and a delay."""
LEAST_SHAPE = 0.15
"""Of a frequency's strongest shape: weaker ones are left out."""


def choose_modes(
    groups: Sequence[LineGroup],
    structure: Structure,
    band_hz: tuple[float, float],
    settings: MechanicalFitSettings,
    on_progress: Callable[[float], None],
) -> tuple[Refined[ModalStructure], tuple[OrderTried, ...], str]:
    """No group may hold a transient. A delay is tried where modes alone leave something: taken from the first mode on,
    it would stand in for those that are not there yet."""
    most = settings.most_modes + structure.inputs
    best, tried, reason = _one_after_the_other(
        ModalSearch(groups, structure, band_hz, fit_delay=False), structure, most, lambda s: on_progress(0.4 * s)
    )
    if settings.fit_delay and _error(best) >= REACHED:
        search = ModalSearch(groups, structure, band_hz, fit_delay=True)
        other, more, why = _one_after_the_other(search, structure, most, lambda s: on_progress(0.4 + 0.4 * s))
        tried = [*tried, *(replace(each, what=f"{each.what}, with a delay") for each in more)]
        fewer = len(other.logs) < len(best.logs)
        if other.left_out < (ALIKE if fewer else 1 - LEAST_GAIN) * best.left_out:
            best, reason = other, why
    modal, unknowns = _begun(best, structure)
    return in_balance(refined(groups, modal, unknowns, band_hz, most_steps=10)), tuple(tried), reason


def _one_after_the_other(
    search: ModalSearch, structure: Structure, most: int, on_progress: Callable[[float], None]
) -> tuple[FoundModes, list[OrderTried], str]:
    best = search.with_one_more(None)
    tried = [_tried(best, structure, True)]
    for number in range(1, most):
        on_progress(number / most)
        if _error(best) < 1:
            return best, tried, ALLOWED
        more = search.with_one_more(best)
        better = more.left_out < (1 - LEAST_GAIN) * best.left_out
        tried.append(_tried(more, structure, better))
        if not better:
            why = f"One more frequency explains less than {LEAST_GAIN:.0%} of what is left on lines not fitted."
            return best, tried, why
        best = more
    return best, tried, f"{most} frequencies, the most that are allowed, were used."


def _error(found: FoundModes) -> float:
    return float(np.sqrt(found.left_out / max(found.left_out_count, 1)))


def in_balance(fit: Refined[ModalStructure]) -> Refined[ModalStructure]:
    factors = balanced(fit.structure, fit.unknowns)
    return replace(fit, unknowns=fit.unknowns * factors, slope=fit.slope / factors)


def _begun(found: FoundModes, structure: Structure) -> tuple[ModalStructure, FloatArray]:
    """Shapes of rank one: a frequency at which a device moves in several ways becomes several modes."""
    half = len(found.logs) // 2
    rows = []
    for speed, ratio, shape in zip(found.logs[:half], found.logs[half:], found.shapes, strict=True):
        left, strengths, right = np.linalg.svd(shape, full_matrices=False)
        for k in np.flatnonzero(strengths >= LEAST_SHAPE * strengths[0]):
            root = np.sqrt(strengths[k] * structure.mass_scale)
            head = [speed - np.log(structure.speed_scale), ratio]
            rows.append(np.concatenate([head, root * right[k], root * left[:, k]]))
    modal = ModalStructure(
        structure.inputs,
        structure.outputs,
        structure.quantity,
        len(rows),
        structure.mass_scale,
        structure.speed_scale,
        structure.sensor,
        replace(structure.actuator, delay_s=found.delay_s if found.delay_s > 1e-3 * structure.step_s else 0.0),
        structure.rotational,
    )
    return modal, np.concatenate(rows)


def _tried(found: FoundModes, structure: Structure, accepted: bool) -> OrderTried:
    modes = len(found.logs) // 2
    parameters = modes * (2 + structure.inputs * structure.outputs)
    return OrderTried(f"{modes} frequencies, every shape free", modes, parameters, _error(found), accepted)
