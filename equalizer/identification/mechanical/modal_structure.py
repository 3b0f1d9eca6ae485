"""Modal parametrisation of a mechanical model: each mode has its own shape at the commands and at the sensors, for
devices whose sensors are not collocated with the commands."""

from dataclasses import dataclass, replace

import numpy as np

from equalizer.plant.mechanical_model import ActuatorLimits, MechanicalModel, SensorLimits
from equalizer.signals.signal import FloatArray

_BAND_MARGIN = 10.0
"""Factor by which a mode's frequency may lie outside the band of the fit. Heuristic."""
_LEAST_DAMPING_RATIO, _LARGEST_DAMPING_RATIO = 1e-4, 100.0
"""Least and largest damping ratio of a mode; a rigid body on weak springs has the largest. Heuristic."""
_RANK_TOLERANCE = 1e-9
"""Least singular value of the input matrix, relative to the largest: below it, an axis counts as not driven. Chosen
above rounding errors."""
_LARGEST_FLEXIBLE_SHARE = 0.5
"""Largest norm of the input shape of a flexible mode, relative to the largest of the rigid-body modes. Heuristic."""
_RIGID_FREQUENCY_RATIO = 1.5
"""Modes count as rigid-body modes where their frequency is at most this factor above the lowest one. Heuristic."""


@dataclass(frozen=True, slots=True, eq=False)
class ModalStructure:
    """Structure of a modal model. Unknowns per mode: log(w / `speed_scale`) with w its natural frequency (rad/s), log
    of its damping ratio, m entries of its shape at the commands, p entries at the sensors; the modal mass is
    `mass_scale`. The response of the position to the force is

        Y(s) = sum over modes of  c b' / (s² + 2 ratio w s + w²)          c (p,), b (m,): shapes over sqrt(mass_scale)
    """

    inputs: int
    """m, the number of commands."""
    outputs: int
    """p, the number of sensors."""
    quantity: str
    """Quantity of the response, as in `MechanicalModel`."""
    modes: int
    mass_scale: float
    """kg, or kg m² of a rotational model: keeps the entries of the shapes near 1."""
    speed_scale: float
    """rad/s: keeps the logarithms of the frequencies near 0."""
    sensor: SensorLimits
    actuator: ActuatorLimits
    rotational: bool

    @property
    def parameters(self) -> int:
        """Number of unknowns."""
        return self.modes * (2 + self.inputs + self.outputs)

    @property
    def coordinates(self) -> int:
        """Number of coordinates of the model: one per mode."""
        return self.modes

    def build_model(self, unknowns: FloatArray, name: str = "fitted") -> MechanicalModel:
        """Build the model in modal coordinates normalised to unit modal mass. unknowns: (parameters,), mode by mode."""
        mode_rows = unknowns.reshape(self.modes, -1)
        natural_rad_s, damping_ratio = self.speed_scale * np.exp(mode_rows[:, 0]), np.exp(mode_rows[:, 1])
        return MechanicalModel(
            name=name,
            quantity=self.quantity,
            mass=np.eye(self.modes),
            damping=np.diag(2 * damping_ratio * natural_rad_s),
            stiffness=np.diag(natural_rad_s**2),
            input=mode_rows[:, 2 : 2 + self.inputs] / np.sqrt(self.mass_scale),
            output=(mode_rows[:, 2 + self.inputs :] / np.sqrt(self.mass_scale)).T,
            sensor=self.sensor,
            actuator=self.actuator,
            rotational=self.rotational,
        )

    def compute_bounds(self, band_hz: tuple[float, float]) -> tuple[FloatArray, FloatArray]:
        """Compute lower and upper bounds (parameters,) of the unknowns, for a fit in this band; shapes are
        unbounded."""
        lower = np.full((self.modes, 2 + self.inputs + self.outputs), -np.inf)
        upper = -lower
        lower[:, 0] = np.log(2 * np.pi * band_hz[0] / _BAND_MARGIN / self.speed_scale)
        upper[:, 0] = np.log(2 * np.pi * band_hz[1] * _BAND_MARGIN / self.speed_scale)
        lower[:, 1], upper[:, 1] = np.log(_LEAST_DAMPING_RATIO), np.log(_LARGEST_DAMPING_RATIO)
        return lower.ravel(), upper.ravel()


def find_balancing_factors(structure: ModalStructure, unknowns: FloatArray) -> FloatArray:
    """Find factors (parameters,) on the unknowns that limit the norm of each flexible mode's input shape to
    `_LARGEST_FLEXIBLE_SHARE` of the largest of the rigid-body modes, and scale its output shape up by the reciprocal,
    so that no response changes. Sensors that are not collocated do not determine this scale; the limit keeps the mass
    at the commands realistic."""
    mode_rows = unknowns.reshape(structure.modes, -1)
    input_columns = slice(2, 2 + structure.inputs)
    input_norm = np.maximum(np.linalg.norm(mode_rows[:, input_columns], axis=1), 1e-300)
    is_rigid = mode_rows[:, 0] <= mode_rows[:, 0].min() + np.log(_RIGID_FREQUENCY_RATIO)
    largest_norm = _LARGEST_FLEXIBLE_SHARE * input_norm[is_rigid].max()
    input_factor = np.where(is_rigid, 1.0, np.minimum(1.0, largest_norm / input_norm))
    factors = np.ones_like(mode_rows)
    factors[:, input_columns] = input_factor[:, None]
    factors[:, 2 + structure.inputs :] = 1 / input_factor[:, None]
    return np.asarray(factors.ravel())


def transform_to_driven_axes(model: MechanicalModel) -> MechanicalModel:
    """Transform the model to coordinates of component-mode synthesis: first the driven axes, then the remaining modes
    with those axes held (Craig and Bampton). Raises numpy.linalg.LinAlgError where the modes do not move each command's
    axis independently."""
    B = model.input
    m, n = B.shape[1], model.coordinates
    left_vectors, singular_values, right_vectors = np.linalg.svd(B)
    if n < m or singular_values[-1] < _RANK_TOLERANCE * singular_values[0]:
        raise np.linalg.LinAlgError("no mode moves one of the driven axes")
    axis_shapes = left_vectors[:, :m] / singular_values @ right_vectors
    internal_modes = left_vectors[:, m:]
    if n > m:  # fixed-interface modes: those with the driven axes held
        internal_modes = internal_modes @ np.linalg.eigh(internal_modes.T @ model.stiffness @ internal_modes)[1]
    transformation = np.concatenate([axis_shapes, internal_modes], axis=1)
    mass, damping, stiffness = (
        transformation.T @ matrix @ transformation for matrix in (model.mass, model.damping, model.stiffness)
    )
    return replace(
        model,
        mass=(mass + mass.T) / 2,
        damping=(damping + damping.T) / 2,
        stiffness=(stiffness + stiffness.T) / 2,
        input=np.concatenate([np.eye(m), np.zeros((n - m, m))]),
        output=model.output @ transformation,
    )
