"""Relative error of a discovered law against the true one, along motion that no recording contains."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from equalizer.laws.evaluate import evaluate
from equalizer.laws.law import Law
from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class FreshMotion:
    """(samples,) each, SI, by the names that laws use: x, vx, ax, fx, ..., t."""

    columns: Mapping[str, FloatArray]
    added: Mapping[str, FloatArray]
    """Contribution of the true laws to each axis's force (N) or reading (m/s^2), by axis."""
    response: bool
    """Whether `added` belongs to the reading, not to the force."""
    rate_hz: float


def law_error(laws: Sequence[Law], fresh: FreshMotion) -> float:
    """Relative rms error on the worst axis that has a true law; inf where a law gives no finite number. Mass, damping,
    stiffness and a constant of that axis (of a reading: a gain and a constant) are projected out, because the model
    fits them itself."""
    return max(_axis_error(laws, fresh, axis) for axis in fresh.added)


def _axis_error(laws: Sequence[Law], fresh: FreshMotion, axis: str) -> float:
    true, found = fresh.added[axis], np.zeros(len(fresh.added[axis]))
    for law in laws:
        if law.axis[-1] != axis or (law.acts_on == "response") != fresh.response:
            continue
        replaced = {"force": None, "command": f"f{axis}", "response": f"a{axis}"}[law.acts_on]
        predicted = evaluate(law, _begin_at_rest(fresh), fresh.rate_hz)[1:]
        found = found + predicted - (0.0 if replaced is None else fresh.columns[replaced])
    if not np.isfinite(found).all():
        return float("inf")
    fitted_by_model = [
        fresh.columns[name] for name in ((f"a{axis}",) if fresh.response else (f"a{axis}", f"v{axis}", axis))
    ]
    base = np.linalg.qr(np.column_stack([*(_normalise(column) for column in fitted_by_model), np.ones(len(true))]))[0]

    def norm_beyond_model(force: FloatArray) -> float:
        return float(np.linalg.norm(force - base @ (base.T @ force)))

    return norm_beyond_model(true - found) / max(norm_beyond_model(true), 1e-300)


def _begin_at_rest(fresh: FreshMotion) -> Mapping[str, FloatArray]:
    """The signals with a sample of rest before them: what a law remembers began there, as the device did."""
    columns = {name: np.concatenate([[0.0], column]) for name, column in fresh.columns.items()}
    return columns | {"t": np.concatenate([[fresh.columns["t"][0] - 1 / fresh.rate_hz], fresh.columns["t"]])}


def _normalise(column: FloatArray) -> FloatArray:
    return np.asarray(column / max(float(np.linalg.norm(column)), 1e-300))
