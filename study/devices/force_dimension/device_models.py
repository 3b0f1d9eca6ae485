"""Device models of Force Dimension that can be opened (omega.3 to sigma.7), with their constants.

Imports no large package, so that commands which only need the names start quickly.
"""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class DeviceModel:
    """Constants of a device model of the vendor."""

    name: str
    """Name as written by the vendor."""
    system_types: tuple[int, ...]
    """Values of dhdGetSystemType for this model (SDK 3.17.5)."""
    max_force_n: float
    """Largest continuous force along any direction at the centre (N). Source: table of devices in the library
    CHAI3D."""
    effective_mass_kg: float
    """Effective mass at the handle, from which the stiffness of the centring spring is computed. The vendor publishes
    none: the values are assumptions. The spring's natural frequency changes with the square root of the ratio of
    assumed to true mass."""
    effector_mass_kg: float | None
    """Mass for the gravity compensation (kg); the omega.3's is that of configurations for CHAI3D. None: the library's
    default."""


MODELS = {
    "omega3": DeviceModel("omega.3", (33,), 12.0, 0.28, 0.148),
    "omega6": DeviceModel("omega.6", (34, 36), 12.0, 0.6, None),
    "omega7": DeviceModel("omega.7", (35, 37), 12.0, 0.6, None),
    "delta3": DeviceModel("delta.3", (63,), 20.0, 0.5, None),
    "sigma7": DeviceModel("sigma.7", (104, 105), 12.0, 0.8, None),
}
"""Models by the name that `--device` takes."""


def find_model_key(system_type: int) -> str | None:
    """Find the key of `MODELS` for a value of dhdGetSystemType; None for another device of the vendor."""
    return next((name for name, model in MODELS.items() if system_type in model.system_types), None)
