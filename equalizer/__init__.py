"""Models of a haptic device, their identification, and the control that equalizes its response.

Functions are pure: values in, values out, independent of protocols and sessions.

Folders, each using only those before it: `signals` (recordings), `laws` (formulas of forces), `plant` (models of the
device) and `linkage` (its kinematics), `effects` (physics that a model may lack, and simulation), `identification`
(recordings -> models), `tracking` (models -> forces). Begin at `signals.signal` and `signals.recording` (the two basic
types), then `plant.identified_model`, `tracking.feedforward.equalizer` (the interface that a stimulus passes through).
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from equalizer.effects.catalogue import EFFECTS as EFFECTS
    from equalizer.identification.mechanical.mechanical_fit import fit_mechanical_model as fit_mechanical_model
    from equalizer.identification.state_space.identify_recordings import identify_recordings as identify
    from equalizer.identification.state_space.settings import IdentificationSettings as IdentificationSettings
    from equalizer.plant.identified_model import IdentifiedModel as IdentifiedModel
    from equalizer.plant.mechanical_model import MechanicalModel as MechanicalModel
    from equalizer.signals.recording import Recording as Recording
    from equalizer.signals.recording import Segment as Segment
    from equalizer.signals.signal import Signal as Signal
    from equalizer.tracking.feedforward.feedforward import compute_feedforward_forces as equalize
    from equalizer.tracking.lqr.lqr import compute_stored_gains as stored_gains
    from equalizer.tracking.lqr.lqr import track as track
    from equalizer.tracking.lqr.tracking_problem import TrackingProblem as TrackingProblem

_HOME = {
    "EFFECTS": "equalizer.effects.catalogue:EFFECTS",
    "IdentificationSettings": "equalizer.identification.state_space.settings:IdentificationSettings",
    "IdentifiedModel": "equalizer.plant.identified_model:IdentifiedModel",
    "MechanicalModel": "equalizer.plant.mechanical_model:MechanicalModel",
    "Recording": "equalizer.signals.recording:Recording",
    "Segment": "equalizer.signals.recording:Segment",
    "Signal": "equalizer.signals.signal:Signal",
    "TrackingProblem": "equalizer.tracking.lqr.tracking_problem:TrackingProblem",
    "equalize": "equalizer.tracking.feedforward.feedforward:compute_feedforward_forces",
    "fit_mechanical_model": "equalizer.identification.mechanical.mechanical_fit:fit_mechanical_model",
    "identify": "equalizer.identification.state_space.identify_recordings:identify_recordings",
    "stored_gains": "equalizer.tracking.lqr.lqr:compute_stored_gains",
    "track": "equalizer.tracking.lqr.lqr:track",
}
"""Module and name of each export. `__getattr__` imports it on access, because importing a module may take seconds."""

__all__ = [
    "EFFECTS",
    "IdentificationSettings",
    "IdentifiedModel",
    "MechanicalModel",
    "Recording",
    "Segment",
    "Signal",
    "TrackingProblem",
    "equalize",
    "fit_mechanical_model",
    "identify",
    "stored_gains",
    "track",
]


def __getattr__(name: str) -> Any:
    """Return the export of this name, imported on access (PEP 562). Raises AttributeError for any other name."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module, _, attribute = _HOME[name].partition(":")
    return getattr(import_module(module), attribute)


def __dir__() -> list[str]:
    return sorted(__all__)
