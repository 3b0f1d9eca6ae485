"""Weighted residuals of a mechanical model on measured lines, and their Jacobian.

Residual of an output at a line:  r = w (Y - G U),  with  w = 1 / sqrt(noise variance + (floor |Y|)²),  so that E|r|² is
about 1; for segments with a transient, less the best fit of the free response of the states at both ends. |Y|² is
averaged over neighbouring lines.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from equalizer.identification.frequency_response.noise_floor import smooth_over_lines
from equalizer.identification.mechanical.mechanical_lines import SegmentLines, have_same_lines, thin_lines
from equalizer.identification.mechanical.mechanical_response import (
    PoleForm,
    compute_free_response,
    compute_pole_form,
    compute_sampled_response,
)
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Hold
from equalizer.signals.signal import BoolArray, ComplexArray, FloatArray

LARGEST_SCATTER = 0.25
"""Upper limit of the scatter that counts as noise, relative to a channel's largest response near a line; heuristic.
Where resonances shift with the level, segments differ more, and without a limit lines with most of the motion would get
little weight."""
_SCATTER_SMOOTHING_LINES = 9
"""Number of lines over which scatter and response are averaged. Chosen."""


def add_scatter_noise(segments: Sequence[SegmentLines]) -> tuple[SegmentLines, ...]:
    """Raise the noise of segments to the scatter between them, where more segments than inputs have the same lines.
    segments: of the same band, by `select_band`.

    Scatter is the residual of the best linear response: friction and other nonlinearities make segments with the same
    lines differ between realisations, directions and levels.
    """
    return tuple(
        _raise_noise_to_scatter(segment, [candidate for candidate in segments if have_same_lines(segment, candidate)])
        for segment in segments
    )


def _raise_noise_to_scatter(segment: SegmentLines, same_line_segments: Sequence[SegmentLines]) -> SegmentLines:
    """Raise the noise of a segment to the scatter of the segments with the same lines; unchanged where these are no
    more than the inputs."""
    m = segment.command.shape[1]
    if len(same_line_segments) <= m:
        return segment
    command_rms = [_compute_command_rms(segment_lines) for segment_lines in same_line_segments]
    response_powers = [
        np.abs(segment_lines.response / rms) ** 2
        for segment_lines, rms in zip(same_line_segments, command_rms, strict=True)
    ]
    largest_scatter = LARGEST_SCATTER**2 * smooth_over_lines(np.max(response_powers, axis=0), _SCATTER_SMOOTHING_LINES)
    scatter = (
        np.minimum(_estimate_scatter(same_line_segments, command_rms), largest_scatter)
        * _compute_command_rms(segment) ** 2
    )
    return replace(segment, noise=np.fmax(segment.noise, scatter))


def _compute_command_rms(segment_lines: SegmentLines) -> float:
    """Compute the rms magnitude of the command over lines and inputs, at least 1e-300, so that it can divide."""
    return max(float(np.sqrt(np.mean(np.abs(segment_lines.command) ** 2))), 1e-300)


def _estimate_scatter(segments: Sequence[SegmentLines], command_rms: Sequence[float]) -> FloatArray:
    """Estimate the scatter (lines, p): residual power of the best linear response at each line, per degree of freedom,
    for a command of rms magnitude 1; segments are scaled to it. command_rms: rms magnitude of each segment's
    command."""
    m = segments[0].command.shape[1]
    excitation_scale = np.array([segment.excited / rms for segment, rms in zip(segments, command_rms, strict=True)]).T[
        :, :, None
    ]
    command = np.stack([segment.command for segment in segments], axis=1) * excitation_scale
    response = np.stack([segment.response for segment in segments], axis=1) * excitation_scale
    basis, triangle = np.linalg.qr(command)
    diagonal_magnitudes = np.abs(np.diagonal(triangle, axis1=1, axis2=2))
    has_full_rank = diagonal_magnitudes.min(axis=1) > 1e-6 * diagonal_magnitudes.max()
    explained_power = np.sum(np.abs(np.swapaxes(basis.conj(), 1, 2) @ response) ** 2, axis=1)
    residual_power = np.maximum(np.sum(np.abs(response) ** 2, axis=1) - explained_power, 0.0)
    degrees_of_freedom = np.count_nonzero(excitation_scale[:, :, 0], axis=1) - m
    is_usable = has_full_rank & (degrees_of_freedom > 0)
    smoothed_power = smooth_over_lines(np.where(is_usable[:, None], residual_power, 0.0), _SCATTER_SMOOTHING_LINES)
    return np.asarray(
        smoothed_power
        / np.maximum(
            smooth_over_lines(np.where(is_usable, degrees_of_freedom, 0.0)[:, None], _SCATTER_SMOOTHING_LINES), 1e-12
        )
    )


HELD_OUT_STRIDE = 4
"""One line in this many is held out for cross-validation of structures. Chosen."""
_LARGEST_TRANSIENT = 1e120
"""Amplitude of a transient's spectrum above which it is not fitted, because squares in the fit would overflow."""
_RELATIVE_STEP = 1e-6
"""Step of finite differences, relative to the unknown, or to 1 for an unknown below 1."""


@dataclass(frozen=True, slots=True, eq=False)
class LineGroup:
    """Weighted spectra of segments with the same lines, compressed by QR: residual = target - root G, with unit
    expected power per uncompressed entry."""

    frequency_hz: FloatArray
    root: ComplexArray
    """(lines, p, rows, m): weighted commands, a row per segment until compressed."""
    target: ComplexArray
    """(lines, p, rows): weighted responses."""
    weight: FloatArray
    """(lines, p): 1 / expected error of the response, of the first segment of the group."""
    held_out: BoolArray
    """(lines,): held out for cross-validation of structures."""
    count: FloatArray
    """(lines,): number of residuals that were compressed into the rows."""
    transient: bool
    rate_hz: float
    hold: Hold

    def exclude_held_out(self) -> "LineGroup":
        """Exclude the lines held out for cross-validation: the fitted lines remain."""
        return self.select_lines(~self.held_out)

    def limit_lines(self, max_lines: int) -> "LineGroup":
        """Limit the group to `max_lines` lines (`thin_lines`), with held-out lines chosen anew."""
        weight_power = np.sum(self.weight**2, axis=1)
        command_power = np.sum(np.abs(self.root) ** 2, axis=(1, 2, 3)) / np.maximum(weight_power, 1e-300)
        is_chosen = np.zeros(len(self.frequency_hz), dtype=np.bool_)
        is_chosen[thin_lines(command_power, max_lines)] = True
        thinned_group = self.select_lines(is_chosen)
        return replace(thinned_group, held_out=_select_held_out_lines(len(thinned_group.frequency_hz)))

    def select_lines(self, is_chosen: BoolArray) -> "LineGroup":
        """Restrict the group to the lines where the mask `is_chosen` (lines,) is true."""
        return LineGroup(
            self.frequency_hz[is_chosen], self.root[is_chosen], self.target[is_chosen], self.weight[is_chosen],
            self.held_out[is_chosen], self.count[is_chosen], self.transient, self.rate_hz, self.hold,
        )  # fmt: skip


def build_line_groups(segments: Sequence[SegmentLines], floor: float) -> tuple[LineGroup, ...]:
    """Build weighted groups of the segments; periodic segments with the same lines are compressed into a common group.
    floor: expected error of a linear model, relative to the response's magnitude."""
    groups: list[LineGroup] = []
    for segment in add_scatter_noise(segments):
        weight = _compute_line_weights(segment, floor)
        root = weight[:, :, None, None] * segment.command[:, None, None, :]
        target = (weight * segment.response)[:, :, None]
        held_out = _select_held_out_lines(len(segment.frequency_hz))
        group = LineGroup(
            segment.frequency_hz, root, target, weight, held_out, np.count_nonzero(weight, axis=1).astype(float),
            segment.transient, segment.rate_hz, segment.hold,
        )  # fmt: skip
        matching_indices = [
            i for i, existing_group in enumerate(groups) if not group.transient and _can_merge(group, existing_group)
        ]
        if matching_indices:
            groups[matching_indices[0]] = _merge_groups(groups[matching_indices[0]], group)
        else:
            groups.append(group)
    return tuple(groups)


def compute_misfits(groups: Sequence[LineGroup], model: MechanicalModel) -> list[ComplexArray]:
    """Compute the weighted residuals of each group, (lines, p, rows), after transients were fitted to the lines not
    held out. Raises numpy.linalg.LinAlgError where the state matrix cannot be diagonalised."""
    form, misfits = compute_pole_form(model), []
    spectra: dict[tuple[bytes, float, Hold, bool], tuple[ComplexArray, ComplexArray | None]] = {}
    for group in groups:
        grid = (group.frequency_hz.tobytes(), group.rate_hz, group.hold, group.transient)
        if grid not in spectra:  # segments of one length share their lines
            spectra[grid] = (
                compute_sampled_response(model, group.frequency_hz, group.rate_hz, group.hold, form),
                _compute_transient_spectra(group, model, form) if group.transient else None,
            )
        response, transient_spectra = spectra[grid]
        misfit = group.target - (group.root @ response[..., None])[..., 0]
        misfits.append(misfit if transient_spectra is None else _subtract_transient(group, transient_spectra, misfit))
    return misfits


def _compute_transient_spectra(group: LineGroup, model: MechanicalModel, form: PoleForm) -> ComplexArray:
    """Compute the spectra of the free response to each state and, of accelerations, of the last command's direct effect
    on each output, (lines, p, columns). form: pole-residue form of the model."""
    free_response = compute_free_response(model, group.frequency_hz, group.rate_hz, form)
    if model.quantity != "acceleration":
        return free_response
    # The last command before the segment acts directly on the first response.
    feedthrough = np.broadcast_to(np.eye(model.outputs), (len(free_response), model.outputs, model.outputs))
    return np.concatenate([free_response, feedthrough], axis=2)


def stack_real(parts: Sequence[ComplexArray]) -> FloatArray:
    """Stack the real parts, then the imaginary parts, of all arrays in a real vector; the sum of squares is
    preserved."""
    stacked = np.concatenate([part.ravel() for part in parts])
    return np.concatenate([stacked.real, stacked.imag])


def compute_numerical_jacobian(
    residuals: Callable[[FloatArray], FloatArray],
    unknowns: FloatArray,
    base_residuals: FloatArray,
    upper_bounds: FloatArray,
) -> FloatArray:
    """Compute the Jacobian (residuals, unknowns) by forward differences, backward where a step would exceed
    `upper_bounds`. base_residuals: residuals at `unknowns`."""
    columns = np.empty((len(base_residuals), len(unknowns)))
    for index in range(len(unknowns)):
        step = _RELATIVE_STEP * max(1.0, abs(unknowns[index]))
        step = -step if unknowns[index] + step > upper_bounds[index] else step
        shifted_unknowns = unknowns.copy()
        shifted_unknowns[index] += step
        columns[:, index] = (residuals(shifted_unknowns) - base_residuals) / step
    return columns


def _compute_line_weights(segment: SegmentLines, floor: float) -> FloatArray:
    """Compute the weights (lines, p), 1 / sqrt(noise + floor² |response|²), with |response|² averaged over five lines
    (chosen); 0 at lines that are not excited, and of a channel that is zero throughout. Such a channel whose own
    command is zero too is not coupled to the others: its |response|² counts as the largest of any channel. Noise that
    is not known (NaN) counts as 0; a small constant avoids a division by zero."""
    power = np.abs(segment.response) ** 2
    is_uncoupled, inputs = np.asarray(~power.any(axis=0)), segment.command.shape[1]
    is_uncoupled[:inputs] &= ~segment.command.any(axis=0)
    is_uncoupled[inputs:] = False  # without a command of their own
    power = np.where(is_uncoupled, power.max(axis=1, keepdims=True, initial=0.0), power)
    smoothed_power = smooth_over_lines(power, 5)
    noise = np.where(np.isfinite(segment.noise), segment.noise, 0.0)
    floor_power = 1e-12 * power.max(axis=0, initial=0.0) + 1e-300
    is_weighted = segment.excited[:, None] & power.any(axis=0)
    return np.asarray(is_weighted / np.sqrt(noise + floor**2 * smoothed_power + floor_power))


def _select_held_out_lines(lines: int) -> BoolArray:
    """Select the lines held out for cross-validation, one in `HELD_OUT_STRIDE`; returns a mask (lines,)."""
    return np.asarray(np.arange(lines) % HELD_OUT_STRIDE == HELD_OUT_STRIDE // 2)


def _can_merge(group: LineGroup, existing: LineGroup) -> bool:
    """Whether the existing group has no transient, and the same rate, hold and lines."""
    return (
        not existing.transient
        and (group.rate_hz, group.hold) == (existing.rate_hz, existing.hold)
        and len(group.frequency_hz) == len(existing.frequency_hz)
        and bool(np.allclose(group.frequency_hz, existing.frequency_hz))
    )


def _merge_groups(group: LineGroup, added_group: LineGroup) -> LineGroup:
    """Append the rows of `added_group`; more than m + 1 rows are reduced by QR, which keeps the sum of squares for any
    G."""
    root = np.concatenate([group.root, added_group.root], axis=2)
    target = np.concatenate([group.target, added_group.target], axis=2)
    if root.shape[2] > root.shape[3] + 1:  # m + 1 rows contain all information for the least squares
        triangle = np.asarray(np.linalg.qr(np.concatenate([root, target[..., None]], axis=3), mode="r"))
        root, target = triangle[..., :-1], triangle[..., -1]
    return LineGroup(
        group.frequency_hz, root, target, group.weight, group.held_out, group.count + added_group.count,
        group.transient, group.rate_hz, group.hold,
    )  # fmt: skip


def _subtract_transient(group: LineGroup, spectra: ComplexArray, misfit: ComplexArray) -> ComplexArray:
    """Subtract the combination of weighted `spectra` (lines, p, columns), with real coefficients, that fits the lines
    not held out. Unchanged where a weighted entry exceeds `_LARGEST_TRANSIENT`."""
    basis = group.weight[:, :, None] * spectra
    if not np.abs(basis).max(initial=0.0) < _LARGEST_TRANSIENT:
        return misfit  # the search may try an unstable model, whose free response overflows
    is_fitted = ~group.held_out
    columns, target = basis[is_fitted].reshape(-1, basis.shape[2]), misfit[is_fitted].reshape(-1)
    real_columns = np.concatenate([columns.real, columns.imag])
    scale = np.maximum(np.linalg.norm(real_columns, axis=0), 1e-300)
    coefficients = (
        np.linalg.lstsq(real_columns / scale, np.concatenate([target.real, target.imag]), rcond=1e-10)[0] / scale
    )
    return np.asarray(misfit - (basis @ coefficients)[:, :, None])
