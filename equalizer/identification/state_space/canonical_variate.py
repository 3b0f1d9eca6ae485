"""Poles and output shapes from several time records by canonical variate analysis (CVA), a subspace identification
method (Larimore, Canonical variate analysis in identification, filtering, and adaptive control, IEEE CDC 1990).

The state is the part of the past (commands and responses) that best predicts the future responses, once the effect of
future commands is removed: canonical correlations between past and future. Each row of the data matrix [future
commands, past, future responses] belongs to a sampling instant. Each record is reduced to the triangular factor of the
QR decomposition of its data matrix, and the factors are stacked and reduced again: no row mixes samples of two records,
and the cost is proportional to the number of records.
"""

from collections.abc import Sequence

import numpy as np
from scipy.signal import resample_poly

from equalizer.identification.state_space.modal_form import ModalForm, build_form_from_poles
from equalizer.identification.state_space.stable_poles import stabilise_poles
from equalizer.signals.recording import Recording
from equalizer.signals.signal import ComplexArray, FloatArray

LEAST_RATE_OVER_BAND = 3.5
"""Least number of samples per period of the band's upper end in decimated records. Chosen above the limit of 2 of the
sampling theorem, which leaves room for the low-pass filter."""
LEAST_SAMPLES_PER_COLUMN = 4
"""Rows that a record must have, times the number of records, per column of the data matrix: more equations than
unknowns. Chosen."""
_UNDRIVEN_SEGMENT_KINDS = ("rest", "free")
"""Kinds of segments without a command: rest and free decay."""


def choose_decimation_factor(sample_rate_hz: float, high_hz: float) -> int:
    """Choose the largest decimation factor that leaves `LEAST_RATE_OVER_BAND` samples or more per period of high_hz; 1
    where none does."""
    return max(1, int(sample_rate_hz / (LEAST_RATE_OVER_BAND * high_hz)))


def collect_driven_records(recordings: Sequence[Recording], decimation_factor: int) -> list[FloatArray]:
    """Collect commands and responses side by side, (n, m + p) each: every driven segment that is not held out for a
    test, with its mean removed, then low-pass filtered and decimated by `decimation_factor`. Segments with missing
    samples are left out."""
    records = []
    for recording in recordings:
        signals = np.hstack([recording.command.samples, recording.response.samples])
        for segment in recording.segments:
            samples = signals[segment.start : segment.stop]
            if segment.kind in _UNDRIVEN_SEGMENT_KINDS or segment.role == "test" or not np.isfinite(samples).all():
                continue
            centred = samples - samples.mean(axis=0)
            records.append(resample_poly(centred, 1, decimation_factor, axis=0) if decimation_factor > 1 else centred)
    return records


def estimate_observability(records: Sequence[FloatArray], inputs: int, horizon: int) -> FloatArray | None:
    """Estimate the extended observability matrix (horizon p, horizon p), largest canonical correlation first; None
    where no record has enough samples.

    records: (n, m + p) each, commands first; inputs: m; horizon: number of past samples, and of future samples.
    """
    column_count = 2 * horizon * records[0].shape[1] if records else 0
    long_records = [
        record
        for record in records
        if len(record) > LEAST_SAMPLES_PER_COLUMN * column_count / max(len(records), 1) + 2 * horizon
    ]
    if not long_records:
        return None
    triangle = np.vstack(
        [_compute_qr_triangle(_stack_past_and_future(record, inputs, horizon)) for record in long_records]
    )
    triangle = _compute_qr_triangle(triangle)
    p = records[0].shape[1] - inputs
    past_start, future_start = horizon * inputs, triangle.shape[1] - horizon * p
    predicted_part, innovation_part = (
        triangle[past_start:future_start, future_start:],
        triangle[future_start:, future_start:],
    )
    # Covariance L L' of the future responses, given the future commands: part predicted by the past, and innovation.
    covariance = predicted_part.T @ predicted_part + innovation_part.T @ innovation_part
    # Raised above rounding errors, so that it is positive definite.
    covariance[np.diag_indices_from(covariance)] += 1e-13 * np.trace(covariance)
    covariance_root = np.linalg.cholesky(covariance)
    # Canonical correlations are the singular values of L^-1 predicted_part', because the past is orthonormal in the QR
    # basis.
    vectors, correlations, _ = np.linalg.svd(np.linalg.solve(covariance_root, predicted_part.T), full_matrices=False)
    return np.asarray(covariance_root @ (vectors * np.sqrt(correlations)), dtype=np.float64)


def _compute_qr_triangle(rows: FloatArray) -> FloatArray:
    """Compute the triangular factor R of the QR decomposition of rows (n, k); R'R equals rows' rows."""
    return np.asarray(np.linalg.qr(rows, mode="r"), dtype=np.float64)


def _stack_past_and_future(record: FloatArray, inputs: int, horizon: int) -> FloatArray:
    """Stack the data matrix (instants, 2 horizon m + 2 horizon p): future commands, then past commands and responses,
    then future responses, with one row per sampling instant."""
    windows = np.lib.stride_tricks.sliding_window_view(record, 2 * horizon, axis=0).transpose(0, 2, 1)
    past, future = windows[:, :horizon], windows[:, horizon:]
    instants = len(windows)
    return np.hstack(
        [
            future[:, :, :inputs].reshape(instants, -1),
            past.reshape(instants, -1),
            future[:, :, inputs:].reshape(instants, -1),
        ]
    )


def estimate_poles_and_shapes(
    extended_observability: FloatArray, outputs: int, order: int, decimation_factor: int, radius: float
) -> ModalForm:
    """Estimate the modal form of a model of this order at the full rate. The poles are the eigenvalues of the matrix A
    that shifts the observability matrix by one sample, in least squares. A pole of the decimated records becomes its
    factor-th root. extended_observability: result of `estimate_observability`; decimation_factor: of the records;
    radius: largest magnitude of a pole at the full rate."""
    observability = extended_observability[:, :order]
    eigenvalues, eigenvectors = np.linalg.eig(
        np.linalg.lstsq(observability[:-outputs], observability[outputs:], rcond=None)[0]
    )
    decimated_poles: ComplexArray = stabilise_poles(eigenvalues, radius**decimation_factor)
    # A negative real pole may have no real factor-th root; the positive pole with the same decay is used.
    rootable_poles = np.where(
        (decimated_poles.imag == 0) & (decimated_poles.real < 0), -decimated_poles, decimated_poles
    )
    return build_form_from_poles(
        stabilise_poles(rootable_poles ** (1 / decimation_factor), radius), observability[:outputs] @ eigenvectors
    )
