"""Names of the vendor's devices that can be opened. Light to import: the command line needs the names."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class DeviceModel:
    """Constants of a device model of the vendor."""

    name: str
    """Name as written by the vendor."""
    system_types: tuple[int, ...]
    """Return value of dhdGetSystemType (SDK 3.17.5)."""
    max_force_n: float
    """Continuous maximum along any direction at the centre, as CHAI3D's table of devices has it."""
    effective_mass_kg: float
    """At the handle; the centring spring is made from it. The vendor publishes none: these are assumptions, from the
    simulated omega.3 and from the heavier wrists. An error changes the spring's natural frequency by its root."""
    effector_mass_kg: float | None
    """Mass for the gravity compensation. None: the library's default."""


MODELS = {
    "omega3": DeviceModel("omega.3", (33,), 12.0, 0.28, 0.148),
    "omega6": DeviceModel("omega.6", (34, 36), 12.0, 0.6, None),
    "omega7": DeviceModel("omega.7", (35, 37), 12.0, 0.6, None),
    "delta3": DeviceModel("delta.3", (63,), 20.0, 0.5, None),
    "sigma7": DeviceModel("sigma.7", (104, 105), 12.0, 0.8, None),
}
"""Models by the name that `--device` takes."""


def name_of_type(system_type: int) -> str | None:
    """The name that `--device` takes for a device that was found."""
    return next((name for name, model in MODELS.items() if system_type in model.system_types), None)
