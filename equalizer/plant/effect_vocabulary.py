"""Vocabulary of physical effects that a model may lack: their names, places, parameters and units, as in model files.

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

    def unit_in(self, system: UnitSystem, response_unit: str) -> str:
        """Unit of the parameter in a model with this unit system whose response is in `response_unit`."""
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


def _required(name: str, unit: str, rotational: str = "") -> EffectParameter:
    """A parameter that a file must state. rotational: its unit in a rotational model, empty where it is the same."""
    return EffectParameter(name, unit, rotational or unit)


def _optional(name: str, unit: str, rotational: str = "") -> EffectParameter:
    return EffectParameter(name, unit, rotational or unit, optional=True)


def _level(name: str) -> EffectParameter:
    return _required(name, "N", "N m")


def _stiffness(name: str) -> EffectParameter:
    return _required(name, "N/m", "N m/rad")


def _damping(name: str) -> EffectParameter:
    return _required(name, "N s/m", "N m s/rad")


def _mass(name: str) -> EffectParameter:
    return _required(name, "kg", "kg m^2")


MATRIX_UNITS = {"mass": _mass("mass"), "damping": _damping("damping"), "stiffness": _stiffness("stiffness")}
"""Units of the entries of a model's matrices."""


def matrix_unit(part: str, system: UnitSystem) -> str:
    """Unit of a model's mass, damping or stiffness matrix. part: mass, damping or stiffness."""
    return MATRIX_UNITS[part].unit_in(system, "1")


# Units are SI; `_level` is a force or a torque.
EFFECT_NAMES: tuple[EffectName, ...] = (
    EffectName("coulomb_friction", "mechanism", (_level("level"),)),
    EffectName("asymmetric_friction", "mechanism", (_level("level_positive"), _level("level_negative"))),
    EffectName(
        "stribeck_friction", "mechanism", (_level("coulomb"), _level("static"), _required("speed", "m/s", "rad/s"))
    ),
    EffectName(
        "position_dependent_friction",
        "mechanism",
        (_level("level"), _required("slope_per_m", "1/m", "1/rad"), _required("bend_per_m2", "1/m^2", "1/rad^2")),
    ),
    EffectName("presliding_hysteresis", "mechanism", (_level("level"), _stiffness("stiffness"))),
    EffectName("viscous_damping", "mechanism", (_damping("damping"),)),
    EffectName("quadratic_damping", "mechanism", (_required("coefficient", "N s^2/m^2", "N m s^2/rad^2"),)),
    EffectName("hardening_stiffness", "mechanism", (_required("k3", "N/m^3", "N m/rad^3"),)),
    EffectName("asymmetric_stiffness", "mechanism", (_required("k2", "N/m^2", "N m/rad^2"),)),
    EffectName("constant_force", "mechanism", (_level("force"),)),
    EffectName("gravity_torque", "mechanism", (_required("torque", "N m"), _required("angle", "rad"))),
    EffectName(
        "cogging", "mechanism", (_level("amplitude"), _required("pitch", "m", "rad"), _optional("phase", "rad"))
    ),
    EffectName(
        "backlash",
        "mechanism",
        (
            _required("gap", "m", "rad"),
            _optional("motor_mass", "kg", "kg m^2"),
            _optional("contact_stiffness", "N/m", "N m/rad"),
            _optional("contact_damping", "N s/m", "N m s/rad"),
        ),
    ),
    EffectName("loose_joint", "mechanism", (_required("gap", "m", "rad"), _stiffness("stiffness"), _level("slip"))),
    EffectName(
        "end_stop",
        "mechanism",
        (
            _required("position", "m", "rad"),
            _stiffness("stiffness"),
            _optional("opposite", "1"),
            _optional("side", "1"),
        ),
    ),
    EffectName(
        "pose_dependent_inertia", "mechanism", (_required("per_m", "1/m", "1/rad"), _optional("speed_share", "1"))
    ),
    EffectName(
        "extra_mode",
        "mechanism",
        (
            _required("frequency", "Hz"),
            _mass("mass"),
            _required("damping_ratio", "1"),
            _optional("tilt_next", "1"),
            _optional("tilt_after_next", "1"),
        ),
    ),
    EffectName("added_mass", "mechanism", (_mass("mass"),)),
    EffectName("hand_impedance", "hand", (_mass("mass"), _damping("damping"), _stiffness("stiffness"))),
    EffectName(
        "time_varying_grip",
        "hand",
        (
            _required("rate_hz", "Hz"),
            _required("depth", "1"),
            _optional("phase", "rad"),
            _optional("stiffness_share", "1"),
        ),
    ),
    EffectName("body_on_actuator", "actuator", (_mass("mass"), _damping("damping"), _stiffness("stiffness"))),
    EffectName("force_saturation", "actuator", (_level("limit"),)),
    EffectName("force_deadband", "actuator", (_level("width"), _optional("jump", "1"))),
    EffectName("slew_limit", "actuator", (_required("rate", "N/s", "N m/s"),)),
    EffectName("amplifier_lag", "actuator", (_required("time_constant", "s"),)),
    EffectName("transport_delay", "actuator", (_required("delay", "s"),)),
    EffectName("force_gain", "actuator", (_required("gain", "1"),)),
    EffectName("force_nonlinearity", "actuator", (_required("square", "1"), _level("reference"))),
    EffectName("sensor_lag", "sensor", (_required("bandwidth", "Hz"),)),
    EffectName("sensor_clipping", "sensor", (_required("limit", RESPONSE),)),
    EffectName(
        "sensor_misalignment",
        "sensor",
        (_required("degrees", "deg"), *(_optional(f"about_{axis}", "deg") for axis in "xyz")),
    ),
    EffectName("cross_axis_sensitivity", "sensor", (_required("from_next", "1"), _required("from_after_next", "1"))),
    EffectName("sensor_gain", "sensor", (_required("gain", "1"),)),
    EffectName("sensor_nonlinearity", "sensor", (_required("cubic", f"1/{RESPONSE}^2"),)),
    EffectName("sensor_offset", "sensor", (_required("offset", RESPONSE),)),
    EffectName(
        "sensor_drift", "sensor", (_required("total", RESPONSE), _optional("bend", "1"), _optional("start", "1"))
    ),
    EffectName("quantization", "sensor", (_required("step", RESPONSE),)),
    EffectName(
        "mains_hum",
        "sensor",
        (_required("amplitude", RESPONSE), _required("frequency", "Hz"), _optional("phase", "rad")),
    ),
    EffectName(
        "clock_drift",
        "sensor",
        (_required("ppm", "ppm"), _optional("interpolated", "1"), _optional("with_position", "1")),
    ),
    EffectName("logger_offset", "sensor", (_required("offset", "s"), _optional("interpolated", "1"))),
    EffectName("lost_samples", "sensor", (_required("fraction", "1"),)),
)

DISCOVERED_LAW = "discovered_law"
"""Name of an effect that is a formula with free parameters p0, p1, …; see `equalizer.laws`. Its place follows from the
quantity on which it acts (`LAW_PLACES`)."""
LAW_PLACES: dict[str, Place] = {"force": "mechanism", "command": "actuator", "response": "sensor"}
"""Place of a law, by the quantity on which it acts (`equalizer.laws.law.ActsOn`)."""

EFFECTS_BY_NAME: dict[str, EffectName] = {effect.name: effect for effect in EFFECT_NAMES}
