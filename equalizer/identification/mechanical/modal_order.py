"""Order selection of modes with free shapes, for sensors that are not collocated with the commands.

Forward selection: a further mode is adopted while the squared error on held-out lines falls enough (`modal_search`
finds it). Shapes (p, m) are then split into rank-one modes by singular value decomposition, and all unknowns are
refined. Thresholds are chosen.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from equalizer.identification.mechanical.mechanical_fit_result import MechanicalFitSettings, OrderCandidate
from equalizer.identification.mechanical.mechanical_misfit import LineGroup
from equalizer.identification.mechanical.mechanical_order import OUT_OF_TIME, TARGET_REACHED
from equalizer.identification.mechanical.mechanical_refinement import RefinedFit, refine_unknowns
from equalizer.identification.mechanical.mechanical_structure import Structure
from equalizer.identification.mechanical.modal_search import ModalSearch, ModeEstimate
from equalizer.identification.mechanical.modal_structure import ModalStructure, find_balancing_factors
from equalizer.signals.signal import FloatArray

LEAST_GAIN = 0.08
"""Smallest relative fall of the cross-validated squared error for which a further frequency, with its shape, is
adopted; equal to `mechanical_order.LEAST_GAIN`."""
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
        ModalSearch(groups, structure, band_hz, fit_delay=False),
        structure,
        most_modes,
        lambda share: on_progress(0.4 * share),
        settings.time_left,
    )
    if settings.fit_delay and settings.time_left() and _compute_held_out_error(best) >= DELAY_ERROR:
        search = ModalSearch(groups, structure, band_hz, fit_delay=True)
        delayed_estimate, delayed_trials, delayed_reason = _add_modes(
            search, structure, most_modes, lambda share: on_progress(0.4 + 0.4 * share), settings.time_left
        )
        trials = [
            *trials,
            *(replace(trial, description=f"{trial.description}, with a delay") for trial in delayed_trials),
        ]
        has_fewer_modes = len(delayed_estimate.logs) < len(best.logs)
        if (
            delayed_estimate.held_out_squares
            < (DELAY_RATIO if has_fewer_modes else 1 - LEAST_GAIN) * best.held_out_squares
        ):
            best, reason = delayed_estimate, delayed_reason
    modal_structure, unknowns = _split_into_rank_one_modes(best, structure)
    return (
        balance_fit(refine_unknowns(groups, modal_structure, unknowns, band_hz, max_evaluations=10)),
        tuple(trials),
        reason,
    )


def _add_modes(
    search: ModalSearch,
    structure: Structure,
    most_modes: int,
    on_progress: Callable[[float], None],
    time_left: Callable[[], bool],
) -> tuple[ModeEstimate, list[OrderCandidate], str]:
    """Add modes, up to `most_modes`, while the error on held-out lines falls enough. Returns the estimate, the orders
    tried, and the reason for the end."""
    best = search.add_mode(None)
    trials = [_record_trial(best, structure, True)]
    for number in range(1, most_modes):
        on_progress(number / most_modes)
        if _compute_held_out_error(best) < 1:
            return best, trials, TARGET_REACHED
        if not time_left():
            return best, trials, OUT_OF_TIME
        extended = search.add_mode(best)
        is_accepted = extended.held_out_squares < (1 - LEAST_GAIN) * best.held_out_squares
        trials.append(_record_trial(extended, structure, is_accepted))
        if not is_accepted:
            reason = f"One more frequency explains less than {LEAST_GAIN:.0%} of the residual on held-out lines."
            return best, trials, reason
        best = extended
    return best, trials, f"{most_modes} frequencies, the most that are allowed, were used."


def _compute_held_out_error(estimate: ModeEstimate) -> float:
    """Compute the rms error on the held-out lines, in units of the expected error."""
    return float(np.sqrt(estimate.held_out_squares / max(estimate.held_out_count, 1)))


def balance_fit(fit: RefinedFit[ModalStructure]) -> RefinedFit[ModalStructure]:
    """Scale the unknowns of a fit by the factors of `find_balancing_factors`; every response is unchanged."""
    factors = find_balancing_factors(fit.structure, fit.unknowns)
    return replace(fit, unknowns=fit.unknowns * factors, jacobian=fit.jacobian / factors)


def _split_into_rank_one_modes(estimate: ModeEstimate, structure: Structure) -> tuple[ModalStructure, FloatArray]:
    """Split modes with shapes of any rank into rank-one modes; returns their structure and unknowns. A frequency whose
    shape has a higher rank becomes several modes. A delay of a thousandth of a step or less (chosen) becomes zero."""
    mode_count = len(estimate.logs) // 2
    mode_unknowns = []
    for log_frequency, log_damping_ratio, shape in zip(
        estimate.logs[:mode_count], estimate.logs[mode_count:], estimate.shapes, strict=True
    ):
        left_vectors, singular_values, right_vectors = np.linalg.svd(shape, full_matrices=False)
        for k in np.flatnonzero(singular_values >= MIN_SINGULAR_VALUE * singular_values[0]):
            root = np.sqrt(singular_values[k] * structure.mass_scale)
            pole_unknowns = [log_frequency - np.log(structure.speed_scale), log_damping_ratio]
            mode_unknowns.append(np.concatenate([pole_unknowns, root * right_vectors[k], root * left_vectors[:, k]]))
    modal_structure = ModalStructure(
        structure.inputs,
        structure.outputs,
        structure.quantity,
        len(mode_unknowns),
        structure.mass_scale,
        structure.speed_scale,
        structure.sensor,
        replace(structure.actuator, delay_s=estimate.delay_s if estimate.delay_s > 1e-3 * structure.step_s else 0.0),
        structure.rotational,
    )
    return modal_structure, np.concatenate(mode_unknowns)


def _record_trial(estimate: ModeEstimate, structure: Structure, accepted: bool) -> OrderCandidate:
    """Record an estimate as an entry of the result. accepted: whether it was adopted in its series of trials (without
    or with a delay)."""
    mode_count = len(estimate.logs) // 2
    parameter_count = mode_count * (2 + structure.inputs * structure.outputs)
    return OrderCandidate(
        f"{mode_count} frequencies, every shape free",
        mode_count,
        parameter_count,
        _compute_held_out_error(estimate),
        accepted,
    )
