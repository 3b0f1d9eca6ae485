"""Order selection of modes with free shapes, for sensors that are not collocated with the commands.

Forward selection: a further mode is adopted while the squared error on held-out lines falls enough (`modal_search`
finds it). Shapes (p, m) of full rank are then reduced to rank-one modes by singular value decomposition, and all
unknowns are refined. Thresholds are heuristic.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from equalizer.identification.mechanical.mechanical_fit_result import MechanicalFitSettings, OrderCandidate
from equalizer.identification.mechanical.mechanical_misfit import LineGroup
from equalizer.identification.mechanical.mechanical_order import TARGET_REACHED
from equalizer.identification.mechanical.mechanical_refinement import RefinedFit, refine_unknowns
from equalizer.identification.mechanical.mechanical_structure import Structure
from equalizer.identification.mechanical.modal_search import ModalSearch, ModeEstimate
from equalizer.identification.mechanical.modal_structure import ModalStructure, find_balancing_factors
from equalizer.signals.signal import FloatArray

LEAST_GAIN = 0.08
"""Smallest relative fall of the cross-validated squared error for which a further frequency, with its shape, is
adopted."""
DELAY_ERROR = 1.02
"""Cross-validated rms error, in units of noise and floor, from which a delay is tried."""
DELAY_RATIO = 1.1
"""Largest ratio of the cross-validated squared errors with and without a delay, where it needs fewer modes."""
MIN_SINGULAR_VALUE = 0.15
"""Singular value of a shape, relative to the largest at the same frequency, below which its rank-one part is left
out."""


def choose_modes(
    groups: Sequence[LineGroup],
    structure: Structure,
    band_hz: tuple[float, float],
    settings: MechanicalFitSettings,
    on_progress: Callable[[float], None],
) -> tuple[RefinedFit[ModalStructure], tuple[OrderCandidate, ...], str]:
    """Choose the number of modes. Groups must not contain transients. Returns the fit, all orders tried, and the reason
    for the choice. A delay is tried only where modes alone leave an error of `DELAY_ERROR` or more, because a delay can
    substitute missing modes."""
    most_modes = settings.most_modes + structure.inputs
    best, trials, reason = _add_modes(
        ModalSearch(groups, structure, band_hz, fit_delay=False), structure, most_modes, lambda s: on_progress(0.4 * s)
    )
    if settings.fit_delay and _compute_held_out_error(best) >= DELAY_ERROR:
        search = ModalSearch(groups, structure, band_hz, fit_delay=True)
        delayed, delayed_trials, delayed_reason = _add_modes(
            search, structure, most_modes, lambda s: on_progress(0.4 + 0.4 * s)
        )
        trials = [
            *trials,
            *(replace(trial, description=f"{trial.description}, with a delay") for trial in delayed_trials),
        ]
        has_fewer_modes = len(delayed.logs) < len(best.logs)
        if delayed.held_out_squares < (DELAY_RATIO if has_fewer_modes else 1 - LEAST_GAIN) * best.held_out_squares:
            best, reason = delayed, delayed_reason
    modal, unknowns = _split_into_rank_one_modes(best, structure)
    return balance_fit(refine_unknowns(groups, modal, unknowns, band_hz, max_evaluations=10)), tuple(trials), reason


def _add_modes(
    search: ModalSearch, structure: Structure, most_modes: int, on_progress: Callable[[float], None]
) -> tuple[ModeEstimate, list[OrderCandidate], str]:
    """Add modes, up to `most_modes`, while the error on held-out lines falls enough; also the orders tried and the
    reason."""
    best = search.add_mode(None)
    trials = [_record_trial(best, structure, True)]
    for number in range(1, most_modes):
        on_progress(number / most_modes)
        if _compute_held_out_error(best) < 1:
            return best, trials, TARGET_REACHED
        extended = search.add_mode(best)
        is_accepted = extended.held_out_squares < (1 - LEAST_GAIN) * best.held_out_squares
        trials.append(_record_trial(extended, structure, is_accepted))
        if not is_accepted:
            reason = f"One more frequency explains less than {LEAST_GAIN:.0%} of the residual on held-out lines."
            return best, trials, reason
        best = extended
    return best, trials, f"{most_modes} frequencies, the most that are allowed, were used."


def _compute_held_out_error(estimate: ModeEstimate) -> float:
    """Rms error on the held-out lines, in units of the expected error."""
    return float(np.sqrt(estimate.held_out_squares / max(estimate.held_out_count, 1)))


def balance_fit(fit: RefinedFit[ModalStructure]) -> RefinedFit[ModalStructure]:
    """The same fit with the factors of `find_balancing_factors` on its unknowns; every response is unchanged."""
    factors = find_balancing_factors(fit.structure, fit.unknowns)
    return replace(fit, unknowns=fit.unknowns * factors, jacobian=fit.jacobian / factors)


def _split_into_rank_one_modes(modes: ModeEstimate, structure: Structure) -> tuple[ModalStructure, FloatArray]:
    """Rank-one modes, as a structure and its unknowns: a frequency whose shape has a higher rank becomes several
    modes."""
    half = len(modes.logs) // 2
    rows = []
    for speed, ratio, shape in zip(modes.logs[:half], modes.logs[half:], modes.shapes, strict=True):
        left_vectors, singular_values, right_vectors = np.linalg.svd(shape, full_matrices=False)
        for k in np.flatnonzero(singular_values >= MIN_SINGULAR_VALUE * singular_values[0]):
            root = np.sqrt(singular_values[k] * structure.mass_scale)
            pole_unknowns = [speed - np.log(structure.speed_scale), ratio]
            rows.append(np.concatenate([pole_unknowns, root * right_vectors[k], root * left_vectors[:, k]]))
    modal = ModalStructure(
        structure.inputs,
        structure.outputs,
        structure.quantity,
        len(rows),
        structure.mass_scale,
        structure.speed_scale,
        structure.sensor,
        replace(structure.actuator, delay_s=modes.delay_s if modes.delay_s > 1e-3 * structure.step_s else 0.0),
        structure.rotational,
    )
    return modal, np.concatenate(rows)


def _record_trial(estimate: ModeEstimate, structure: Structure, accepted: bool) -> OrderCandidate:
    modes = len(estimate.logs) // 2
    parameters = modes * (2 + structure.inputs * structure.outputs)
    return OrderCandidate(
        f"{modes} frequencies, every shape free", modes, parameters, _compute_held_out_error(estimate), accepted
    )
