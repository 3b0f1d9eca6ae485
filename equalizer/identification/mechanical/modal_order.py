"""Order selection of modes with free shapes, for sensors that are not collocated with the commands.

Forward selection: a further mode is adopted while the squared error on held-out lines falls enough (`modal_search`
finds it). Shapes (p, m) of full rank are then reduced to rank-one modes by singular value decomposition, and all
unknowns are refined. Thresholds are heuristic.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from equalizer.identification.mechanical.mechanical_fit_result import MechanicalFitSettings, OrderTried
from equalizer.identification.mechanical.mechanical_misfit import LineGroup
from equalizer.identification.mechanical.mechanical_order import ALLOWED
from equalizer.identification.mechanical.mechanical_refinement import RefinedFit, refine_unknowns
from equalizer.identification.mechanical.mechanical_structure import Structure
from equalizer.identification.mechanical.modal_search import FoundModes, ModalSearch
from equalizer.identification.mechanical.modal_structure import ModalStructure, find_balancing_factors
from equalizer.signals.signal import FloatArray

LEAST_GAIN = 0.08
"""Smallest relative fall of the cross-validated squared error for which a further frequency, with its shape, is
adopted."""
REACHED = 1.02
"""Cross-validated rms error, in units of noise and floor, from which a delay is tried."""
ALIKE = 1.1
"""Largest ratio of the cross-validated squared errors with and without a delay, where it needs fewer modes."""
LEAST_SHAPE = 0.15
"""Singular value of a shape, relative to the largest at the same frequency, below which its rank-one part is left
out."""


def choose_modes(
    groups: Sequence[LineGroup],
    structure: Structure,
    band_hz: tuple[float, float],
    settings: MechanicalFitSettings,
    on_progress: Callable[[float], None],
) -> tuple[RefinedFit[ModalStructure], tuple[OrderTried, ...], str]:
    """Choose the number of modes. Groups must not contain transients. Returns the fit, all orders tried, and the reason
    for the choice. A delay is tried only where modes alone leave an error of `REACHED` or more, because a delay can
    substitute missing modes."""
    most = settings.most_modes + structure.inputs
    best, tried, reason = _add_modes(
        ModalSearch(groups, structure, band_hz, fit_delay=False), structure, most, lambda s: on_progress(0.4 * s)
    )
    if settings.fit_delay and _left_out_error(best) >= REACHED:
        search = ModalSearch(groups, structure, band_hz, fit_delay=True)
        other, more, why = _add_modes(search, structure, most, lambda s: on_progress(0.4 + 0.4 * s))
        tried = [*tried, *(replace(each, what=f"{each.what}, with a delay") for each in more)]
        fewer = len(other.logs) < len(best.logs)
        if other.left_out < (ALIKE if fewer else 1 - LEAST_GAIN) * best.left_out:
            best, reason = other, why
    modal, unknowns = _rank_one_modes(best, structure)
    return balance_fit(refine_unknowns(groups, modal, unknowns, band_hz, most_steps=10)), tuple(tried), reason


def _add_modes(
    search: ModalSearch, structure: Structure, most: int, on_progress: Callable[[float], None]
) -> tuple[FoundModes, list[OrderTried], str]:
    """Add modes, up to `most`, while the error on held-out lines falls enough; also the orders tried and the reason."""
    best = search.add_mode(None)
    tried = [_record_trial(best, structure, True)]
    for number in range(1, most):
        on_progress(number / most)
        if _left_out_error(best) < 1:
            return best, tried, ALLOWED
        more = search.add_mode(best)
        better = more.left_out < (1 - LEAST_GAIN) * best.left_out
        tried.append(_record_trial(more, structure, better))
        if not better:
            why = f"One more frequency explains less than {LEAST_GAIN:.0%} of the residual on held-out lines."
            return best, tried, why
        best = more
    return best, tried, f"{most} frequencies, the most that are allowed, were used."


def _left_out_error(found: FoundModes) -> float:
    """Rms error on the held-out lines, in units of the expected error."""
    return float(np.sqrt(found.left_out / max(found.left_out_count, 1)))


def balance_fit(fit: RefinedFit[ModalStructure]) -> RefinedFit[ModalStructure]:
    """The same fit with the factors of `find_balancing_factors` on its unknowns; every response is unchanged."""
    factors = find_balancing_factors(fit.structure, fit.unknowns)
    return replace(fit, unknowns=fit.unknowns * factors, slope=fit.slope / factors)


def _rank_one_modes(found: FoundModes, structure: Structure) -> tuple[ModalStructure, FloatArray]:
    """Rank-one modes, as a structure and its unknowns: a frequency whose shape has a higher rank becomes several
    modes."""
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


def _record_trial(found: FoundModes, structure: Structure, accepted: bool) -> OrderTried:
    modes = len(found.logs) // 2
    parameters = modes * (2 + structure.inputs * structure.outputs)
    return OrderTried(f"{modes} frequencies, every shape free", modes, parameters, _left_out_error(found), accepted)
