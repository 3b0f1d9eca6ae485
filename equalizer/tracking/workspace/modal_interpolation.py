"""Modal interpolation: a model for a place between the places of identified models, with interpolated resonances.

A weighted sum of responses would contain the resonances of every model. Here the resonances in the band are matched
between models (`mode_matching`), and their natural frequencies, damping ratios and residues are interpolated. The
remainder of each response without its resonances is smooth and is interpolated linearly. The sum is realised as a
state-space model, with fixed real poles for the remainder.

Sizes: m inputs (forces), p outputs (accelerations).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import block_diag
from scipy.sparse.csgraph import breadth_first_order, minimum_spanning_tree

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.signals.signal import ComplexArray, FloatArray
from equalizer.tracking.workspace.band_modes import BandLines, BandMode, compute_band_lines, find_band_modes
from equalizer.tracking.workspace.mode_matching import ModesDoNotMatchError, match_modes
from equalizer.tracking.workspace.models_at_place import ModelsAtPlace
from equalizer.tracking.workspace.place_weights import compute_place_weights
from equalizer.tracking.workspace.workspace_models import Place, WorkspaceModels

REAL_POLES_PER_OCTAVE = 2.0
"""Number of fixed real poles, which describe the smooth remainder, per octave of the model's band. They are spread over
a wider range (`LOWEST_POLE_RATIO`, `HIGHEST_POLE_RATIO`), and thus less densely. Chosen by hand; the error of the fit
is tested against `REMARK_THRESHOLD` for every place."""
LOWEST_POLE_RATIO, HIGHEST_POLE_RATIO = 0.3, 4.5
"""Frequency of the lowest and the highest of these poles, relative to the lower and the upper end of the band.
Chosen by hand."""
RANK_TOLERANCE = 0.1
"""Singular values below this share of the largest are not counted in the rank of a residue matrix. The interpolated
residue is truncated to the largest rank of the models' residues, because a sum of matrices may have a higher rank.
Chosen by hand."""
REMARK_THRESHOLD = 0.02
"""Error of the fit of the remainder, relative to the total response of the line, above which the user gets a remark.
Chosen by hand."""


@dataclass(frozen=True, slots=True, eq=False)
class ModalInterpolation:
    """Matched resonances of all models, and the smooth remainders of their responses."""

    workspace: WorkspaceModels
    tracks: tuple[tuple[BandMode, ...], ...]
    """For each resonance, its mode in every model, in the order of the models."""
    lines: BandLines
    """Lines of the band, the same for all models; its response is that of the first model."""
    remainders: ComplexArray
    """(models, lines, p, m), m/s² per N: responses without the matched resonances."""

    def interpolate_at(self, place_m: Place) -> ModelsAtPlace:
        """Interpolate a single model for a place (m), valid in the models' common band. Remarks state a place outside
        the convex hull of the models, and a fit of the remainder whose error exceeds `REMARK_THRESHOLD`."""
        weights = compute_place_weights(self.workspace.places_m, place_m)
        modes = [_interpolate_mode(track, weights.smooth) for track in self.tracks]
        remainder = np.einsum("k,klpm->lpm", weights.linear, self.remainders)
        total_response = remainder + sum(
            (mode.compute_response(self.lines.z) for mode in modes), np.zeros_like(remainder)
        )
        model, fit_error = _assemble_model(self, modes, remainder, np.linalg.norm(total_response, axis=(1, 2)))
        remarks = [weights.remark] if weights.remark else []
        if fit_error > REMARK_THRESHOLD:
            remarks.append(f"the interpolated model has a fit error of up to {100 * fit_error:.1f} % of the response")
        placed_model = replace(model, place_m=place_m)
        return ModelsAtPlace(place_m, (placed_model,), (1.0,), tuple(remarks))


def build_modal_interpolation(workspace: WorkspaceModels) -> ModalInterpolation:
    """Find and match the resonances of all models. Raises ModesDoNotMatchError where the matching of resonances of
    neighbouring models is ambiguous."""
    band_hz = workspace.band_hz
    modes = [find_band_modes(model, band_hz) for model in workspace.models]
    tracks = _track_modes(workspace, modes)
    band_lines = [compute_band_lines(model, band_hz) for model in workspace.models]
    remainders = []
    for model_index, model_lines in enumerate(band_lines):
        resonant_response = sum(
            (track[model_index].compute_response(model_lines.z) for track in tracks),
            np.zeros_like(model_lines.response),
        )
        remainders.append(model_lines.response - resonant_response)
    return ModalInterpolation(workspace, tracks, band_lines[0], np.array(remainders))


def _track_modes(workspace: WorkspaceModels, modes: Sequence[Sequence[BandMode]]) -> tuple[tuple[BandMode, ...], ...]:
    """Match the modes of each resonance from neighbour to neighbour along the minimum spanning tree of the places.
    Returns tuples (resonances, models) without resonances that are missing in a model. modes: per model."""
    places_m = workspace.places_m
    distances_m = np.linalg.norm(places_m[:, None] - places_m[None], axis=2)
    spanning_tree = minimum_spanning_tree(distances_m)
    visiting_order, predecessors = breadth_first_order(spanning_tree, 0, directed=False)
    mode_indices_by_track: dict[int, dict[int, int]] = {
        mode_index: {0: mode_index} for mode_index in range(len(modes[0]))
    }
    for node in visiting_order[1:]:
        parent = int(predecessors[node])
        try:
            pairs = dict(match_modes(modes[parent], modes[node], workspace.band_hz))
        except ModesDoNotMatchError as error:
            raise ModesDoNotMatchError(f"models {parent + 1} (first) and {node + 1} (second): {error}") from error
        for track in mode_indices_by_track.values():
            if track.get(parent) in pairs:
                track[int(node)] = pairs[track[parent]]
    complete_tracks = [track for track in mode_indices_by_track.values() if len(track) == len(modes)]
    return tuple(
        tuple(modes[model_index][track[model_index]] for model_index in range(len(modes))) for track in complete_tracks
    )


def _interpolate_mode(track: Sequence[BandMode], weights: FloatArray) -> BandMode:
    """Interpolate a mode: frequency and damping ratio by weighted geometric means, residue divided by frequency by a
    weighted mean. track: the mode in each model; weights: (models,), sum 1."""
    natural_hz = float(np.exp(weights @ np.log([mode.natural_hz for mode in track])))
    damping_ratio = float(np.exp(weights @ np.log([mode.damping_ratio for mode in track])))
    # The residue of an acceleration response is proportional to the natural frequency. It is divided by it before the
    # interpolation over places, and multiplied by the interpolated frequency afterwards.
    residue = natural_hz * np.einsum("k,kpm->pm", weights, np.array([mode.residue / mode.natural_hz for mode in track]))
    rank = max(_count_rank(mode.residue) for mode in track)
    u, s, vh = np.linalg.svd(residue)
    share = float(weights @ [mode.share for mode in track])
    return BandMode(natural_hz, damping_ratio, (u[:, :rank] * s[:rank]) @ vh[:rank], share, track[0].sample_rate_hz)


def _count_rank(residue: ComplexArray) -> int:
    """Count the singular values of a residue (p, m) above `RANK_TOLERANCE` times the largest."""
    singular_values = np.linalg.svd(residue, compute_uv=False)
    return int((singular_values > RANK_TOLERANCE * singular_values[0]).sum())


def _assemble_model(
    interpolation: ModalInterpolation, modes: Sequence[BandMode], remainder: ComplexArray, total_norm: FloatArray
) -> tuple[IdentifiedModel, float]:
    """Assemble the state-space model of the modes and of the remainder (lines, p, m), which is fitted by least squares
    with fixed real poles; also returns the largest error of that fit relative to `total_norm`, (lines,), the norm of
    the total response. The model has no covariance, no samples of its uncertainty and no quality, which belong to the
    given models; its delay is the least of theirs. Singular values of the basis below 1e-7 of the largest (chosen by
    hand) are dropped, because neighbouring poles have similar responses."""
    first_model, lines = interpolation.workspace.models[0], interpolation.lines
    poles = _choose_remainder_poles(interpolation.workspace.band_hz, first_model.sample_rate_hz)
    basis = np.hstack([(1 - poles) / (lines.z[:, None] - poles), np.ones((len(lines.z), 1))]) / total_norm[:, None]
    scaled_remainder = remainder.reshape(len(total_norm), -1) / total_norm[:, None]
    real_basis = np.vstack([basis.real, basis.imag])
    column_norms = np.linalg.norm(real_basis, axis=0)
    coefficients = (
        np.linalg.lstsq(
            real_basis / column_norms, np.vstack([scaled_remainder.real, scaled_remainder.imag]), rcond=1e-7
        )[0]
        / column_norms[:, None]
    )
    fit_error = float(np.linalg.norm(basis @ coefficients - scaled_remainder, axis=1).max())
    p, m = remainder.shape[1:]
    gains = coefficients.reshape(len(poles) + 1, p, m)
    mode_matrices = [_realise_mode(mode) for mode in modes]
    A = block_diag(*(matrices[0] for matrices in mode_matrices), np.kron(np.diag(poles), np.eye(m)))
    B = np.vstack(
        [
            *(matrices[1] for matrices in mode_matrices),
            np.tile(np.eye(m), (len(poles), 1)) * np.repeat(1 - poles, m)[:, None],
        ]
    )
    C = np.hstack([*(matrices[2] for matrices in mode_matrices), *gains[:-1]])
    provenance = {
        "method": "modal interpolation",
        "places_m": interpolation.workspace.places_m.tolist(),
        "resonances_hz": [mode.natural_hz for mode in modes],
        "worst_relative_error": fit_error,
    }
    workspace = interpolation.workspace
    delay_samples = min(model.delay_samples for model in workspace.models)
    return replace(
        first_model, A=A, B=B, C=C, D=gains[-1], band_hz=workspace.band_hz, delay_samples=delay_samples,
        covariance=None, samples=None, provenance=provenance, quality=None,
    ), fit_error  # fmt: skip


def _choose_remainder_poles(band_hz: tuple[float, float], rate_hz: float) -> FloatArray:
    """Choose the discrete real poles, (poles,): `REAL_POLES_PER_OCTAVE` for each octave of the band, at least four,
    spaced logarithmically from below the band to above it, at most 0.4 of the sample rate, which is below half of it.
    Chosen by hand."""
    lowest_hz, highest_hz = LOWEST_POLE_RATIO * band_hz[0], min(HIGHEST_POLE_RATIO * band_hz[1], 0.4 * rate_hz)
    pole_count = max(4, round(REAL_POLES_PER_OCTAVE * np.log2(band_hz[1] / band_hz[0])))
    return np.asarray(np.exp(-2 * np.pi * np.geomspace(lowest_hz, highest_hz, pole_count) / rate_hz))


def _realise_mode(mode: BandMode) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Realise R / (z - pole) plus its conjugate by real state-space matrices A, B, C, two states per rank of the
    residue R. Singular values below 1e-9 of the largest are rounding errors of the truncation to that rank."""
    u, s, vh = np.linalg.svd(mode.residue)
    rank = int((s > 1e-9 * s[0]).sum())
    pole = mode.pole
    rotation = np.array([[pole.real, pole.imag], [-pole.imag, pole.real]])
    A = np.kron(np.eye(rank), rotation)
    output_shapes, input_shapes = u[:, :rank] * np.sqrt(s[:rank]), np.sqrt(s[:rank])[:, None] * vh[:rank]
    B = np.concatenate([np.stack([2 * row.real, -2 * row.imag]) for row in input_shapes])
    C = np.hstack([np.column_stack([column.real, column.imag]) for column in output_shapes.T])
    return A, B, C
