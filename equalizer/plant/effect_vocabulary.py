"""Vocabulary of the physical effects in model files: their names, places, parameters and units.

The equations are in `equalizer.effects`, a file for each effect. Meanings of parameters: `gap` is the total play,
`width` half the dead band, `gain` a factor (1 = no effect), `degrees` the total rotation angle; `ppm` > 0 takes the
response at t (1 + ppm 1e-6); `per_m` is in the mass M (1 + per_m x); `total` of a drift and `amplitude` of a hum are
those of the largest channel, where all channels share the effect.
"""

from dataclasses import dataclass
from typing import Literal

from equalizer.signals.unit_system import ROTATIONAL, UnitSystem

Place = Literal["mechanism", "hand", "actuator", "sensor"]
"""Part of the device in which an effect acts."""

RESPONSE = "response"
"""Placeholder for the response's unit in `EffectParameter.unit`."""


@dataclass(frozen=True, slots=True)
class EffectParameter:
    """Name and unit of a parameter of an effect, as model files state it."""

    name: str
    unit: str
    """SI unit in a translational model; RESPONSE is replaced by the unit of the response."""
    rotational_unit: str
    """SI unit in a rotational model."""
    optional: bool = False
    """Whether a file may omit it; it is needed to reproduce an effect exactly as it was fitted."""

    def find_unit(self, system: UnitSystem, response_unit: str) -> str:
        """Unit of the parameter in a model with this unit system; response_unit: unit of the model's response."""
        unit = {False: self.unit, True: self.rotational_unit, None: system.express(self.unit)}[system.rotational]
        if system.rotational is None and self.unit == ROTATIONAL.force:
            unit = system.force
        if unit == f"1/{RESPONSE}^2":
            return f"1/({response_unit})^2"
        return response_unit if unit == RESPONSE else unit


@dataclass(frozen=True, slots=True)
class EffectName:
    """Name of an effect, the place where it acts, and its parameters."""

    name: str
    place: Place
    parameters: tuple[EffectParameter, ...]
    """Parameters; the first is the main parameter, see `main`."""

    @property
    def main(self) -> EffectParameter:
        """The first parameter, which measures the effect's strength."""
        return self.parameters[0]


def _make_required(name: str, unit: str, rotational: str = "") -> EffectParameter:
    """Make a parameter that a file must state. rotational: its unit in a rotational model, empty where it is the
    same."""
    return EffectParameter(name, unit, rotational or unit)


def _make_optional(name: str, unit: str, rotational: str = "") -> EffectParameter:
    """Make a parameter that a file may omit. rotational: as in `_make_required`."""
    return EffectParameter(name, unit, rotational or unit, optional=True)


def _make_level(name: str) -> EffectParameter:
    """Make a required parameter that is a force, or a torque in a rotational model."""
    return _make_required(name, "N", "N m")


def _make_stiffness(name: str) -> EffectParameter:
    """Make a required parameter that is a stiffness."""
    return _make_required(name, "N/m", "N m/rad")


def _make_damping(name: str) -> EffectParameter:
    """Make a required parameter that is a viscous damping."""
    return _make_required(name, "N s/m", "N m s/rad")


def _make_mass(name: str) -> EffectParameter:
    """Make a required parameter that is a mass, or a moment of inertia in a rotational model."""
    return _make_required(name, "kg", "kg m^2")


MATRIX_UNITS = {
    "mass": _make_mass("mass"),
    "damping": _make_damping("damping"),
    "stiffness": _make_stiffness("stiffness"),
}
"""Units of the entries of a model's matrices."""


def find_matrix_unit(part: str, system: UnitSystem) -> str:
    """Unit of the entries of a matrix of a model. part: mass, damping or stiffness; raises KeyError for any other."""
    return MATRIX_UNITS[part].find_unit(system, "1")


# Units are SI; `_make_level` is a force or a torque.
EFFECT_NAMES: tuple[EffectName, ...] = (
    EffectName("coulomb_friction", "mechanism", (_make_level("level"),)),
    EffectName("asymmetric_friction", "mechanism", (_make_level("level_positive"), _make_level("level_negative"))),
    EffectName(
        "stribeck_friction",
        "mechanism",
        (_make_level("coulomb"), _make_level("static"), _make_required("speed", "m/s", "rad/s")),
    ),
    EffectName(
        "position_dependent_friction",
        "mechanism",
        (
            _make_level("level"),
            _make_required("slope_per_m", "1/m", "1/rad"),
            _make_required("bend_per_m2", "1/m^2", "1/rad^2"),
        ),
    ),
    EffectName("presliding_hysteresis", "mechanism", (_make_level("level"), _make_stiffness("stiffness"))),
    EffectName("viscous_damping", "mechanism", (_make_damping("damping"),)),
    EffectName("quadratic_damping", "mechanism", (_make_required("coefficient", "N s^2/m^2", "N m s^2/rad^2"),)),
    EffectName("hardening_stiffness", "mechanism", (_make_required("k3", "N/m^3", "N m/rad^3"),)),
    EffectName("asymmetric_stiffness", "mechanism", (_make_required("k2", "N/m^2", "N m/rad^2"),)),
    EffectName("constant_force", "mechanism", (_make_level("force"),)),
    EffectName("gravity_torque", "mechanism", (_make_required("torque", "N m"), _make_required("angle", "rad"))),
    EffectName(
        "cogging",
        "mechanism",
        (_make_level("amplitude"), _make_required("pitch", "m", "rad"), _make_optional("phase", "rad")),
    ),
    EffectName(
        "backlash",
        "mechanism",
        (
            _make_required("gap", "m", "rad"),
            _make_optional("motor_mass", "kg", "kg m^2"),
            _make_optional("contact_stiffness", "N/m", "N m/rad"),
            _make_optional("contact_damping", "N s/m", "N m s/rad"),
        ),
    ),
    EffectName(
        "loose_joint",
        "mechanism",
        (_make_required("gap", "m", "rad"), _make_stiffness("stiffness"), _make_level("slip")),
    ),
    EffectName(
        "end_stop",
        "mechanism",
        (
            _make_required("position", "m", "rad"),
            _make_stiffness("stiffness"),
            _make_optional("opposite", "1"),
            _make_optional("side", "1"),
        ),
    ),
    EffectName(
        "pose_dependent_inertia",
        "mechanism",
        (_make_required("per_m", "1/m", "1/rad"), _make_optional("speed_share", "1")),
    ),
    EffectName(
        "extra_mode",
        "mechanism",
        (
            _make_required("frequency", "Hz"),
            _make_mass("mass"),
            _make_required("damping_ratio", "1"),
            _make_optional("tilt_next", "1"),
            _make_optional("tilt_after_next", "1"),
        ),
    ),
    EffectName("added_mass", "mechanism", (_make_mass("mass"),)),
    EffectName("hand_impedance", "hand", (_make_mass("mass"), _make_damping("damping"), _make_stiffness("stiffness"))),
    EffectName(
        "time_varying_grip",
        "hand",
        (
            _make_required("rate_hz", "Hz"),
            _make_required("depth", "1"),
            _make_optional("phase", "rad"),
            _make_optional("stiffness_share", "1"),
        ),
    ),
    EffectName(
        "body_on_actuator", "actuator", (_make_mass("mass"), _make_damping("damping"), _make_stiffness("stiffness"))
    ),
    EffectName("force_saturation", "actuator", (_make_level("limit"),)),
    EffectName("force_deadband", "actuator", (_make_level("width"), _make_optional("jump", "1"))),
    EffectName("slew_limit", "actuator", (_make_required("rate", "N/s", "N m/s"),)),
    EffectName("amplifier_lag", "actuator", (_make_required("time_constant", "s"),)),
    EffectName("transport_delay", "actuator", (_make_required("delay", "s"),)),
    EffectName("force_gain", "actuator", (_make_required("gain", "1"),)),
    EffectName("force_nonlinearity", "actuator", (_make_required("square", "1"), _make_level("reference"))),
    EffectName("sensor_lag", "sensor", (_make_required("bandwidth", "Hz"),)),
    EffectName("sensor_clipping", "sensor", (_make_required("limit", RESPONSE),)),
    EffectName(
        "sensor_misalignment",
        "sensor",
        (_make_required("degrees", "deg"), *(_make_optional(f"about_{axis}", "deg") for axis in "xyz")),
    ),
    EffectName(
        "cross_axis_sensitivity", "sensor", (_make_required("from_next", "1"), _make_required("from_after_next", "1"))
    ),
    EffectName("sensor_gain", "sensor", (_make_required("gain", "1"),)),
    EffectName("sensor_nonlinearity", "sensor", (_make_required("cubic", f"1/{RESPONSE}^2"),)),
    EffectName("sensor_offset", "sensor", (_make_required("offset", RESPONSE),)),
    EffectName(
        "sensor_drift",
        "sensor",
        (_make_required("total", RESPONSE), _make_optional("bend", "1"), _make_optional("start", "1")),
    ),
    EffectName("quantization", "sensor", (_make_required("step", RESPONSE),)),
    EffectName(
        "mains_hum",
        "sensor",
        (_make_required("amplitude", RESPONSE), _make_required("frequency", "Hz"), _make_optional("phase", "rad")),
    ),
    EffectName(
        "clock_drift",
        "sensor",
        (_make_required("ppm", "ppm"), _make_optional("interpolated", "1"), _make_optional("with_position", "1")),
    ),
    EffectName("logger_offset", "sensor", (_make_required("offset", "s"), _make_optional("interpolated", "1"))),
    EffectName("lost_samples", "sensor", (_make_required("fraction", "1"),)),
)

DISCOVERED_LAW = "discovered_law"
"""Name of an effect that is a formula with free parameters p0, p1, …; see `equalizer.laws`. Its place follows from the
quantity on which it acts (`LAW_PLACES`)."""
LAW_PLACES: dict[str, Place] = {"force": "mechanism", "command": "actuator", "response": "sensor"}
"""Place of a law, by the quantity on which it acts (`equalizer.laws.law.ActsOn`)."""

EFFECTS_BY_NAME: dict[str, EffectName] = {effect.name: effect for effect in EFFECT_NAMES}
