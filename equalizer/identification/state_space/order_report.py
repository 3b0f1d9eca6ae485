"""Comparison of model orders: singular values, error on held-out lines, multiplications per tick.

Each order is fitted to every second line and tested on the others. The suggested order follows the one-standard-error
rule (Breiman, Friedman, Olshen and Stone, Classification and Regression Trees, 1984): the lowest order whose error on
held-out lines exceeds the least one by no more than the standard error of that difference.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from equalizer.identification.frequency_response.frequency_response import FrequencyResponse
from equalizer.identification.state_space.candidates import choose_best, estimate_subspace_starts, refine_start
from equalizer.identification.state_space.refusals import require_lines
from equalizer.identification.state_space.settings import IdentificationSettings
from equalizer.identification.state_space.warped_subspace import choose_horizon, estimate_subspace
from equalizer.identification.state_space.weighted_lines import WeightedLines
from equalizer.signals.signal import FloatArray

VISIBLE_RATIO = 2.0
"""Ratio to the noise above which a singular value counts as a state. Chosen by hand."""


@dataclass(frozen=True, slots=True)
class OrderRow:
    """Errors and computing cost of a model of this order, fitted to every second line and tested on the others."""

    order: int
    held_out_cost: float
    """Squared error over noise variance on held-out lines: 1 plus the contribution of the model error."""
    held_out_error: float
    """Rms error on held-out lines relative to the rms response (`WeightedLines.compute_relative_error`); noise
    included."""
    multiply_adds_per_tick: int
    """Number of multiplications for one step of the state and the outputs, with poles in blocks of two."""
    dense_multiply_adds_per_tick: int
    """Number of multiplications with a full state matrix."""


@dataclass(frozen=True, slots=True, eq=False)
class OrderReport:
    """Comparison of model orders."""

    singular_values: FloatArray
    """Singular values of the whitened data, largest first: about 1 where there is only noise."""
    visible_order: int
    """Number of singular values above `VISIBLE_RATIO`."""
    rows: tuple[OrderRow, ...]
    """Orders tried, rising."""
    held_out_noise: float
    """Noise of the held-out lines, relative to the rms response: the expected `held_out_error` of a perfect model."""
    suggested_order: int
    """The lowest whose error on held-out lines is not worse than the best one's by more than its standard error."""


def compare_orders(
    response: FrequencyResponse | Sequence[FrequencyResponse],
    settings: IdentificationSettings | None = None,
    orders: Sequence[int] = (10, 14, 16, 20, 26),
    on_progress: Callable[[float], None] | None = None,
) -> OrderReport:
    """Fit every order to every second line and test it on the others. orders: even numbers of states (default chosen).
    on_progress: called with the share done, 0 to 1. Raises IdentificationError as `require_lines` does, for example
    where there are too few lines for the highest order."""
    settings = settings or IdentificationSettings()
    report_progress = on_progress or (lambda _: None)
    responses = (response,) if isinstance(response, FrequencyResponse) else tuple(response)
    top_settings = replace(settings, order=max(orders))
    fit_set, held_out_set = (
        require_lines([estimate.select_lines(_mask_lines(estimate, parity)) for estimate in responses], top_settings)
        for parity in (0, 1)
    )
    line_costs = []
    rows = []
    for index, order in enumerate(sorted(orders)):
        report_progress(index / len(orders))
        trial = replace(settings, order=order)
        best = choose_best([refine_start(start, fit_set, trial) for start in estimate_subspace_starts(fit_set, trial)])
        modelled_response = best.fitted.compute_response(held_out_set.z)
        costs = (np.abs(held_out_set.weight * (modelled_response - held_out_set.response)) ** 2).mean(axis=(1, 2))
        line_costs.append(costs)
        error = float(np.sqrt((held_out_set.compute_relative_error(modelled_response) ** 2).mean()))
        p, m = held_out_set.response.shape[1:]
        rows.append(
            OrderRow(order, float(costs.mean()), error, count_products(order, p, m), count_dense_products(order, p, m))
        )
    report_progress(1.0)
    lines = require_lines(responses, top_settings)
    subspace = estimate_subspace(lines, choose_horizon(max(orders), lines.response.shape[1]), settings.centre_hz)
    singular_values = subspace.singular_values
    return OrderReport(
        singular_values,
        int((singular_values > VISIBLE_RATIO).sum()),
        tuple(rows),
        _compute_relative_noise(held_out_set),
        rows[_suggest_order(line_costs)].order,
    )


def count_products(order: int, outputs: int, inputs: int) -> int:
    """Count the multiplications per tick with poles in blocks of two, as `modal_form` makes them: three per block for
    A, and all of B, C and D."""
    return 3 * order // 2 + order * (outputs + inputs) + outputs * inputs


def count_dense_products(order: int, outputs: int, inputs: int) -> int:
    """Count the multiplications per tick with full matrices A, B, C and D."""
    return order**2 + order * (outputs + inputs) + outputs * inputs


def _mask_lines(response: FrequencyResponse, first_line: int) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Make the mask (lines,) of every second line, from the line with the index `first_line` (0 or 1) on."""
    return np.asarray(np.arange(len(response)) % 2 == first_line)


def _compute_relative_noise(lines: WeightedLines) -> float:
    """Compute the rms noise of the lines relative to the rms response, as in `WeightedLines.compute_relative_error`."""
    return float(np.sqrt((1 / lines.weight**2).sum() / (np.abs(lines.response) ** 2).sum()))


def _suggest_order(line_costs: Sequence[FloatArray]) -> int:
    """Suggest the index of an order by the one-standard-error rule. line_costs: of each order, rising, the squared
    error (lines,) over the noise variance; differences are taken line by line, so that noise common to both orders
    cancels. The standard error is that of their mean over the lines."""
    best_index = int(np.argmin([costs.mean() for costs in line_costs]))
    for index, costs in enumerate(line_costs):
        cost_increase = costs - line_costs[best_index]
        if cost_increase.mean() <= cost_increase.std() / np.sqrt(len(cost_increase)):
            return index
    return best_index
