"""How far a model's masses, dampers and springs depend on how strongly the device was driven: a tolerance to state."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from equalizer.identification.mechanical_fit import fit_mechanical_model
from equalizer.identification.mechanical_fit_result import MechanicalFit, MechanicalFitSettings
from equalizer.plant.mechanical_model import MechanicalModel, Tolerance
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray

RIGID_OCTAVES = 3.0
"""Of the band from its beginning: there the device moves as one piece, and friction shows most."""


@dataclass(frozen=True, slots=True, eq=False)
class AsOnePiece:
    """The device where it moves as one piece, at the stronger level."""

    up_to_hz: float
    mass: FloatArray
    """(m,), at each driven axis"""
    damping: FloatArray
    """(m,), friction's equivalent in it"""
    tolerance: Tolerance
    """Of the whole model."""


def as_one_piece(
    fit: MechanicalFit, strong: Recording, weaker: Recording, settings: MechanicalFitSettings
) -> AsOnePiece:
    """The tolerance is the fit's own, widened to what rigid fits at the two levels differ by, at the worst axis. Of the
    damping: to what it would fall by at forces far above friction, whose equivalent falls as the force grows."""
    low, high = fit.band_hz
    up_to_hz = min(high, low * 2**RIGID_OCTAVES)
    rigid = replace(settings, band_hz=(low, up_to_hz), most_modes=0, fit_delay=False, sensors_elsewhere=False)
    ratio = _amplitude(strong) / _amplitude(weaker)
    fits = [fit_mechanical_model([one], rigid).model for one in (strong, weaker)]
    change = np.abs(_driven(fits[1]) - _driven(fits[0]))
    bias = np.array([change[0].max(), change[1].max() / max(ratio - 1, 1e-3), change[2].max()])
    # Friction's equivalent is as 1 / amplitude: strong = true + c, weaker = true + c ratio.
    mine, rough = fit.model.tolerance or Tolerance(), fits[0].tolerance or Tolerance()
    tolerance = Tolerance(
        mass_kg=max(float(bias[0]), mine.mass_kg or rough.mass_kg or 0.0),
        damping_n_s_per_m=max(float(bias[1]), mine.damping_n_s_per_m or rough.damping_n_s_per_m or 0.0),
        stiffness_n_per_m=max(float(bias[2]), mine.stiffness_n_per_m or rough.stiffness_n_per_m or 0.0),
        modes=mine.modes,
    )
    mass, damping, _ = _driven(fits[0])
    return AsOnePiece(up_to_hz, mass, damping, tolerance)


def _driven(model: MechanicalModel) -> FloatArray:
    """(3, m)"""
    parts: Sequence[FloatArray] = (model.mass, model.damping, model.stiffness)
    return np.array([np.diag(part)[: model.inputs] for part in parts])


def _amplitude(recording: Recording) -> float:
    return max(segment.amplitude for segment in recording.segments)
