"""Quality of an equalized response: flatness, coupling, direction."""

from dataclasses import dataclass

import numpy as np

from equalizer.signals.signal import ComplexArray


@dataclass(frozen=True, slots=True)
class Quality:
    """Worst values over all lines; perfect are 0 dB, -infinity dB, 0 degrees."""

    flatness_db: float
    """Largest deviation of the delivered level along a wanted axis, in either direction."""
    coupling_db: float
    """Largest off-axis response over the response along the wanted axis."""
    axis_error_deg: float
    """Largest angle between the wanted axis and the major axis of the delivered ellipse."""


def quality(delivered: ComplexArray) -> Quality:
    """Flatness, coupling and direction error of an equalized response. delivered: (lines, p, p), delivered over wanted,
    column by column the wanted axis; perfect is the identity."""
    along = np.abs(np.einsum("lii->li", delivered))
    off = np.abs(delivered - np.einsum("li,ij->lij", np.einsum("lii->li", delivered), np.eye(delivered.shape[1])))
    with np.errstate(divide="ignore"):
        flatness_db = float(np.abs(20 * np.log10(along)).max())
        coupling_db = float(20 * np.log10((off.max(axis=1) / along).max()))
    return Quality(flatness_db, coupling_db, max(_axis_error_deg(delivered[:, :, i], i) for i in range(len(along.T))))


def _axis_error_deg(played: ComplexArray, axis: int) -> float:
    """played: (lines, p): the ellipse delivered for a wanted sinusoid along `axis`."""
    worst = 0.0
    for phasor in played:
        ellipse = np.column_stack([phasor.real, phasor.imag])
        long_axis = np.linalg.svd(ellipse)[0][:, 0]
        worst = max(worst, float(np.degrees(np.arccos(min(1.0, abs(long_axis[axis]))))))
    return worst
