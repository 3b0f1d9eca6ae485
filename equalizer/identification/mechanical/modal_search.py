"""Sequential search for the modes of a measured response by variable projection.

    G(s) = sum over modes of  shape_k s^order / (s² + 2 d_k w_k s + w_k²),     shape_k (p, m), order 0, 1 or 2

in continuous time; responses are sampled exactly for the commands' hold. Frequencies w and damping ratios d (and a
delay) are searched by bounded nonlinear least squares; the shapes, which enter linearly, follow by linear least squares
at each step (Golub and Pereyra 1973; Jacobian after Kaufman 1975; references in `state_space.refinement`).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from equalizer.identification.mechanical.mechanical_misfit import LineGroup
from equalizer.identification.mechanical.mechanical_response import compute_pole_responses, compute_sensor_response
from equalizer.identification.mechanical.mechanical_structure import Structure
from equalizer.plant.mechanical_model import DERIVATIVE_OF_QUANTITY
from equalizer.signals.signal import ComplexArray, FloatArray

_FREQUENCY_COUNT = 80
"""Number of natural frequencies on the logarithmic search grid. Chosen."""
_GRID_DAMPING_RATIOS = (0.01, 0.04, 0.16, 0.64, 4.0)
"""Damping ratios on the search grid; above 1 the mode is overdamped. Heuristic."""
_LOG_STEP = 1e-6
"""Step of finite differences: of logarithms, and of the delay in samples. Chosen."""
_MAX_SEARCH_DELAY_SAMPLES = 20.0
"""Largest delay (samples) of the command that the search allows. Chosen."""


@dataclass(frozen=True, slots=True, eq=False)
class ModeEstimate:
    """Modes with free shapes (p m numbers each), and their misfit on the held-out lines."""

    logs: FloatArray
    """(2 modes,): logs of frequencies (rad/s), then of damping ratios."""
    delay_s: float
    shapes: FloatArray
    """(modes, p, m)"""
    held_out_squares: float
    """Sum of squares of the weighted residuals on the held-out lines."""
    held_out_count: int
    """Number of residuals in that sum."""


@dataclass(frozen=True, slots=True, eq=False)
class _Solution:
    """Shapes at given frequencies, damping ratios and delay, by linear least squares."""

    misfit: list[ComplexArray]
    """Residuals of each group, (lines, p, rows)."""
    bases: list[FloatArray]
    """For each output, orthonormal basis of the span of its regressors, on the lines not held out: real, then imaginary
    parts."""
    shapes: FloatArray
    """(modes, p, m)"""


class ModalSearch:
    """Adds modes one at a time to a modal model of line groups, none of which may contain a transient. structure: gives
    numbers of axes and responses, quantity, step, sensor, and delay and bandwidth of the actuator; fit_delay: whether
    the delay is estimated."""

    def __init__(
        self, groups: Sequence[LineGroup], structure: Structure, band_hz: tuple[float, float], fit_delay: bool
    ) -> None:
        self._groups = tuple(groups)
        self._structure = structure
        self._order = DERIVATIVE_OF_QUANTITY[structure.quantity]
        self._band_hz = band_hz
        self._fit_delay = fit_delay
        self._nominal_delay_samples = structure.actuator.delay_s / structure.step_s
        self._fitted_masks = [~group.held_out for group in groups]

    def add_mode(self, current: ModeEstimate | None) -> ModeEstimate:
        """Add a mode at the grid point that explains most, then refine all modes together. The grid reaches from half
        the lower to twice the upper end of the band. current: None for the first mode."""
        logs = np.empty(0) if current is None else current.logs
        delay_samples = self._nominal_delay_samples if current is None else current.delay_s / self._structure.step_s
        solution = self._solve(np.append(logs, delay_samples))
        low_log, high_log = np.log(2 * np.pi * np.array([self._band_hz[0] / 2, self._band_hz[1] * 2]))
        best_point = max(
            ((self._compute_explained_squares(solution, np.array([log_frequency, np.log(ratio), delay_samples])),
              log_frequency, np.log(ratio))
            for log_frequency in np.linspace(low_log, high_log, _FREQUENCY_COUNT) for ratio in _GRID_DAMPING_RATIOS),
        )  # fmt: skip
        modes = len(logs) // 2
        return self._refine(
            np.concatenate([logs[:modes], [best_point[1]], logs[modes:], [best_point[2]], [delay_samples]])
        )

    def _refine(self, start: FloatArray) -> ModeEstimate:
        """Refine the unknowns by bounded least squares: logs of w (rad/s), logs of damping ratios, delay (samples). The
        delay is free only where `fit_delay` and with at least two modes. Bounds, like the stopping limits, are chosen:
        natural frequencies from a tenth of the lower to twice the upper end of the band, damping ratios 1e-3 to 30."""
        # Imported here: a diagnosis that fits no model does not need SciPy's optimiser.
        from scipy.optimize import least_squares

        modes, delay_samples = len(start) // 2, start[-1]
        low_delay_samples, high_delay_samples = (
            (0.0, _MAX_SEARCH_DELAY_SAMPLES)
            if self._fit_delay and modes > 1
            else (delay_samples - 1e-9, delay_samples + 1e-9)
        )
        lower = np.concatenate(
            [np.full(modes, np.log(2 * np.pi * self._band_hz[0] / 10)), np.full(modes, np.log(1e-3))]
        )
        upper = np.concatenate([np.full(modes, np.log(2 * np.pi * self._band_hz[1] * 2)), np.full(modes, np.log(30.0))])
        lower, upper = np.append(lower, low_delay_samples), np.append(upper, high_delay_samples)
        optimum = least_squares(
            lambda unknowns: self._stack_real(self._solve(unknowns).misfit),
            np.clip(start, lower + 1e-10, upper - 1e-10),
            jac=self._compute_jacobian,
            bounds=(lower, upper),
            max_nfev=40,
            ftol=1e-5,
        )
        solution = self._solve(optimum.x)
        group_misfits = list(zip(self._groups, solution.misfit, strict=True))
        return ModeEstimate(
            optimum.x[:-1],
            float(optimum.x[-1]) * self._structure.step_s,
            solution.shapes,
            float(sum(np.sum(np.abs(misfit[group.held_out]) ** 2) for group, misfit in group_misfits)),
            int(sum(group.count[group.held_out].sum() for group in self._groups)),
        )

    def _solve(self, unknowns: FloatArray) -> _Solution:
        """Solve for the shapes by linear least squares on the lines not held out, output by output, and compute the
        residuals on all lines. unknowns: as in `_refine`."""
        m, p, modes = self._structure.inputs, self._structure.outputs, len(unknowns) // 2
        mode_responses = [self._compute_mode_responses(group, unknowns) for group in self._groups]
        shapes = np.zeros((modes, p, m))
        bases = []
        for output in range(p):
            regressor_blocks = [
                (group.root[is_fitted, output][..., None, :] * responses[is_fitted, None, :, None]).reshape(
                    group.target[is_fitted, output].size, modes * m
                )
                for group, responses, is_fitted in zip(self._groups, mode_responses, self._fitted_masks, strict=True)
            ]
            targets = [
                group.target[is_fitted, output].ravel()
                for group, is_fitted in zip(self._groups, self._fitted_masks, strict=True)
            ]
            design, target = (
                _concatenate_real_imaginary(np.concatenate(regressor_blocks)),
                _concatenate_real_imaginary(np.concatenate(targets)),
            )
            scale = np.maximum(np.linalg.norm(design, axis=0), 1e-300)
            q, r = np.linalg.qr(design / scale) if modes else (design, design)
            bases.append(q)
            if modes:
                entries = np.linalg.lstsq(r, q.T @ target, rcond=1e-9)[0] / scale
                shapes[:, output] = entries.reshape(modes, m)
        misfit = [
            group.target - (group.root @ np.einsum("lk,kpm->lpm", responses, shapes)[..., None])[..., 0]
            for group, responses in zip(self._groups, mode_responses, strict=True)
        ]
        return _Solution(misfit, bases, shapes)

    def _compute_jacobian(self, unknowns: FloatArray) -> FloatArray:
        """Compute the Jacobian by Kaufman's approximation: derivative at fixed shapes, by finite differences, with the
        shapes' span projected out."""
        solution = self._solve(unknowns)
        mode_count = len(unknowns) // 2
        columns = []
        for index in range(len(unknowns)):
            # A mode's own parameters change its response alone, the delay changes all of them.
            modes = np.arange(mode_count) if index == 2 * mode_count else np.array([index % mode_count])
            chosen_unknowns = np.concatenate([modes, mode_count + modes, [2 * mode_count]])
            shifted = unknowns.copy()
            shifted[index] += _LOG_STEP
            residual_change = [
                -np.einsum(
                    "lpem,lk,kpm->lpe",
                    group.root,
                    (
                        self._compute_mode_responses(group, shifted[chosen_unknowns])
                        - self._compute_mode_responses(group, unknowns[chosen_unknowns])
                    )
                    / _LOG_STEP,
                    solution.shapes[modes],
                    optimize=True,
                )
                for group in self._groups
            ]
            columns.append(self._project_out(residual_change, solution.bases))
        return np.stack(columns, axis=1)

    def _compute_explained_squares(self, solution: _Solution, unknowns: FloatArray) -> float:
        """Compute how much a further mode lowers the residual sum of squares, all shapes free. unknowns: (3,), of the
        further mode, as in `_refine`."""
        responses = [self._compute_mode_responses(group, unknowns)[:, 0] for group in self._groups]
        explained_squares = 0.0
        for output, basis in enumerate(solution.bases):
            regressor_blocks = [
                (group.root[is_fitted, output] * response[is_fitted, None, None]).reshape(-1, self._structure.inputs)
                for group, response, is_fitted in zip(self._groups, responses, self._fitted_masks, strict=True)
            ]
            design = _concatenate_real_imaginary(np.concatenate(regressor_blocks))
            target = _concatenate_real_imaginary(
                np.concatenate(
                    [
                        group_misfit[is_fitted, output].ravel()
                        for group_misfit, is_fitted in zip(solution.misfit, self._fitted_masks, strict=True)
                    ]
                )
            )
            design = design - basis @ (basis.T @ design)
            q, _ = np.linalg.qr(design / np.maximum(np.linalg.norm(design, axis=0), 1e-300))
            explained_squares += float(np.sum((q.T @ target) ** 2))
        return explained_squares

    def _project_out(self, change: Sequence[ComplexArray], bases: Sequence[FloatArray]) -> FloatArray:
        """Project out of a change of the residuals what a change of the shapes can compensate, output by output."""
        projected_columns = []
        for output, basis in enumerate(bases):
            column = _concatenate_real_imaginary(
                np.concatenate(
                    [
                        group_change[is_fitted, output].ravel()
                        for group_change, is_fitted in zip(change, self._fitted_masks, strict=True)
                    ]
                )
            )
            projected_columns.append(column - basis @ (basis.T @ column))
        return np.concatenate(projected_columns)

    def _stack_real(self, misfit: Sequence[ComplexArray]) -> FloatArray:
        """Stack the residuals on the lines not held out in a real vector, output by output, in the rows' order of the
        bases."""
        return np.concatenate(
            [
                _concatenate_real_imaginary(
                    np.concatenate(
                        [
                            group_misfit[is_fitted, output].ravel()
                            for group_misfit, is_fitted in zip(misfit, self._fitted_masks, strict=True)
                        ]
                    )
                )
                for output in range(self._structure.outputs)
            ]
        )

    def _compute_mode_responses(self, group: LineGroup, unknowns: FloatArray) -> ComplexArray:
        """Compute the responses (lines, modes) of modes of unit mass by partial fractions, sampled exactly, with
        actuator and sensor. A damping ratio within 1e-6 of 1 becomes 1 + 1e-6, because the two poles must differ."""
        modes = len(unknowns) // 2
        natural_rad_s, ratio = np.exp(unknowns[:modes]), np.exp(unknowns[modes : 2 * modes])
        delay_s = max(float(unknowns[-1]), 0.0) / group.rate_hz
        ratio = np.where(np.abs(ratio - 1) < 1e-6, 1 + 1e-6, ratio)
        root = np.sqrt(ratio.astype(np.complex128) ** 2 - 1)
        poles = np.concatenate([natural_rad_s * (-ratio + root), natural_rad_s * (-ratio - root)])
        conjugate_poles = np.concatenate([poles[modes:], poles[:modes]])
        z = np.exp(2j * np.pi * group.frequency_hz / group.rate_hz)
        responses, direct = compute_pole_responses(poles, z, group.rate_hz, group.hold, delay_s)
        pole_terms = responses * (poles**self._order / (poles - conjugate_poles))
        further_term: ComplexArray | float = direct[:, None] if self._order == 2 else 0.0
        if lag_rad_s := 2 * np.pi * self._structure.actuator.bandwidth_hz:
            # Behind the actuator's low pass there is no direct feedthrough, but a third pole.
            lag_pole = np.array([-lag_rad_s], dtype=np.complex128)
            lag_response, _ = compute_pole_responses(lag_pole, z, group.rate_hz, group.hold, delay_s)
            pole_terms *= lag_rad_s / (poles - lag_pole)
            residues = lag_rad_s * lag_pole**self._order / ((lag_pole - poles[:modes]) * (lag_pole - poles[modes:]))
            further_term = np.asarray(lag_response * residues, dtype=np.complex128)
        sensor = compute_sensor_response(self._structure.sensor.bandwidth_hz, z, group.rate_hz)
        return np.asarray((pole_terms[:, :modes] + pole_terms[:, modes:] + further_term) * sensor[:, None])


def _concatenate_real_imaginary(values: ComplexArray) -> FloatArray:
    """Concatenate the real parts and the imaginary parts along the first dimension."""
    return np.concatenate([values.real, values.imag])
