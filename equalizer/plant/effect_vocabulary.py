"""Vocabulary of the physical effects in mechanical model files: their names, places, parameters and units.

`equalizer.effects` has a module for each effect, with its equation and the meaning of the parameters that are not
described here: `gap` is the total play, `width` half the dead band, `gain` a factor (1 = no effect), `degrees` the
total rotation angle; `ppm` > 0 takes the response at t (1 + ppm 1e-6); `per_m` is in the mass M (1 + per_m x).
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
    """Unit in a translational model, SI except degrees and ppm; RESPONSE is replaced by the unit of the response."""
    rotational_unit: str
    """The same in a rotational model."""
    optional: bool = False
    """Whether a file may omit it; it is needed to reproduce an effect exactly as it was fitted."""

    def find_unit(self, system: UnitSystem, response_unit: str) -> str:
        """Return the parameter's unit in a model with this unit system: `unit` or `rotational_unit` in SI; outside SI
        `unit` in the system's units, the command's unit for N m. RESPONSE is replaced by response_unit."""
        unit = {False: self.unit, True: self.rotational_unit, None: system.express(self.unit)}[system.rotational]
        if system.rotational is None and self.unit == ROTATIONAL.force:
            unit = system.force
        if unit == f"1/{RESPONSE}^2":
            return "1" if response_unit == "1" else f"1/({response_unit})^2"
        return response_unit if unit == RESPONSE else unit


@dataclass(frozen=True, slots=True)
class EffectEntry:
    """Entry of the vocabulary: name of an effect, the place where it acts, and its parameters."""

    name: str
    place: Place
    parameters: tuple[EffectParameter, ...]
    """Parameters; the first is the main parameter, see `main`."""

    @property
    def main(self) -> EffectParameter:
        """The first parameter: in most effects the strength, in others such as `end_stop` or `extra_mode` a position or
        frequency."""
        return self.parameters[0]


def _make_required(name: str, unit: str, rotational: str = "") -> EffectParameter:
    """Make a parameter that a file must state. rotational: its unit in a rotational model, empty where it is the
    same."""
    return EffectParameter(name, unit, rotational or unit)


def _make_optional(name: str, unit: str, rotational: str = "") -> EffectParameter:
    """Make a parameter that a file may omit. rotational: as in `_make_required`."""
    return EffectParameter(name, unit, rotational or unit, optional=True)


def _require_force(name: str) -> EffectParameter:
    """Make a required parameter that is a force, or a torque in a rotational model."""
    return _make_required(name, "N", "N m")


def _require_stiffness(name: str) -> EffectParameter:
    """Make a required parameter that is a stiffness."""
    return _make_required(name, "N/m", "N m/rad")


def _require_damping(name: str) -> EffectParameter:
    """Make a required parameter that is a viscous damping."""
    return _make_required(name, "N s/m", "N m s/rad")


def _require_mass(name: str) -> EffectParameter:
    """Make a required parameter that is a mass, or a moment of inertia in a rotational model."""
    return _make_required(name, "kg", "kg m^2")


MATRIX_UNITS = {
    "mass": _require_mass("mass"),
    "damping": _require_damping("damping"),
    "stiffness": _require_stiffness("stiffness"),
}
"""Name and unit of the entries of each matrix of a mechanical model."""


def find_matrix_unit(part: str, system: UnitSystem) -> str:
    """Return the unit of the entries of a matrix of a model. part: mass, damping or stiffness; raises KeyError for any
    other."""
    return MATRIX_UNITS[part].find_unit(system, "1")


EFFECT_ENTRIES: tuple[EffectEntry, ...] = (
    EffectEntry("coulomb_friction", "mechanism", (_require_force("level"),)),
    EffectEntry(
        "asymmetric_friction", "mechanism", (_require_force("level_positive"), _require_force("level_negative"))
    ),
    EffectEntry(
        "stribeck_friction",
        "mechanism",
        (_require_force("coulomb"), _require_force("static"), _make_required("speed", "m/s", "rad/s")),
    ),
    EffectEntry(
        "position_dependent_friction",
        "mechanism",
        (
            _require_force("level"),
            _make_required("slope_per_m", "1/m", "1/rad"),
            _make_required("bend_per_m2", "1/m^2", "1/rad^2"),
        ),
    ),
    EffectEntry("presliding_hysteresis", "mechanism", (_require_force("level"), _require_stiffness("stiffness"))),
    EffectEntry("viscous_damping", "mechanism", (_require_damping("damping"),)),
    EffectEntry("quadratic_damping", "mechanism", (_make_required("coefficient", "N s^2/m^2", "N m s^2/rad^2"),)),
    EffectEntry("hardening_stiffness", "mechanism", (_make_required("k3", "N/m^3", "N m/rad^3"),)),
    EffectEntry("asymmetric_stiffness", "mechanism", (_make_required("k2", "N/m^2", "N m/rad^2"),)),
    EffectEntry("constant_force", "mechanism", (_require_force("force"),)),
    EffectEntry("gravity_torque", "mechanism", (_make_required("torque", "N m"), _make_required("angle", "rad"))),
    EffectEntry(
        "cogging",
        "mechanism",
        (_require_force("amplitude"), _make_required("pitch", "m", "rad"), _make_optional("phase", "rad")),
    ),
    EffectEntry(
        "backlash",
        "mechanism",
        (
            _make_required("gap", "m", "rad"),
            _make_optional("motor_mass", "kg", "kg m^2"),
            _make_optional("contact_stiffness", "N/m", "N m/rad"),
            _make_optional("contact_damping", "N s/m", "N m s/rad"),
        ),
    ),
    EffectEntry(
        "loose_joint",
        "mechanism",
        (_make_required("gap", "m", "rad"), _require_stiffness("stiffness"), _require_force("slip")),
    ),
    EffectEntry(
        "end_stop",
        "mechanism",
        (
            _make_required("position", "m", "rad"),
            _require_stiffness("stiffness"),
            _make_optional("opposite", "1"),
            _make_optional("side", "1"),
        ),
    ),
    EffectEntry(
        "pose_dependent_inertia",
        "mechanism",
        (_make_required("per_m", "1/m", "1/rad"), _make_optional("speed_share", "1")),
    ),
    EffectEntry(
        "extra_mode",
        "mechanism",
        (
            _make_required("frequency", "Hz"),
            _require_mass("mass"),
            _make_required("damping_ratio", "1"),
            _make_optional("tilt_next", "1"),
            _make_optional("tilt_after_next", "1"),
        ),
    ),
    EffectEntry("added_mass", "mechanism", (_require_mass("mass"),)),
    EffectEntry(
        "hand_impedance", "hand", (_require_mass("mass"), _require_damping("damping"), _require_stiffness("stiffness"))
    ),
    EffectEntry(
        "time_varying_grip",
        "hand",
        (
            _make_required("rate_hz", "Hz"),
            _make_required("depth", "1"),
            _make_optional("phase", "rad"),
            _make_optional("stiffness_share", "1"),
        ),
    ),
    EffectEntry(
        "body_on_actuator",
        "actuator",
        (_require_mass("mass"), _require_damping("damping"), _require_stiffness("stiffness")),
    ),
    EffectEntry("force_saturation", "actuator", (_require_force("limit"),)),
    EffectEntry("force_deadband", "actuator", (_require_force("width"), _make_optional("jump", "1"))),
    EffectEntry("slew_limit", "actuator", (_make_required("rate", "N/s", "N m/s"),)),
    EffectEntry("amplifier_lag", "actuator", (_make_required("time_constant", "s"),)),
    EffectEntry("transport_delay", "actuator", (_make_required("delay", "s"),)),
    EffectEntry("force_gain", "actuator", (_make_required("gain", "1"),)),
    EffectEntry("force_nonlinearity", "actuator", (_make_required("square", "1"), _require_force("reference"))),
    EffectEntry("sensor_lag", "sensor", (_make_required("bandwidth", "Hz"),)),
    EffectEntry("sensor_clipping", "sensor", (_make_required("limit", RESPONSE),)),
    EffectEntry(
        "sensor_misalignment",
        "sensor",
        (_make_required("degrees", "deg"), *(_make_optional(f"about_{axis}", "deg") for axis in "xyz")),
    ),
    EffectEntry(
        "cross_axis_sensitivity", "sensor", (_make_required("from_next", "1"), _make_required("from_after_next", "1"))
    ),
    EffectEntry("sensor_gain", "sensor", (_make_required("gain", "1"),)),
    EffectEntry("sensor_nonlinearity", "sensor", (_make_required("cubic", f"1/{RESPONSE}^2"),)),
    EffectEntry("sensor_offset", "sensor", (_make_required("offset", RESPONSE),)),
    EffectEntry(
        "sensor_drift",
        "sensor",
        (_make_required("total", RESPONSE), _make_optional("bend", "1"), _make_optional("start", "1")),
    ),
    EffectEntry("quantization", "sensor", (_make_required("step", RESPONSE),)),
    EffectEntry(
        "mains_hum",
        "sensor",
        (_make_required("amplitude", RESPONSE), _make_required("frequency", "Hz"), _make_optional("phase", "rad")),
    ),
    EffectEntry(
        "clock_drift",
        "sensor",
        (_make_required("ppm", "ppm"), _make_optional("interpolated", "1"), _make_optional("with_position", "1")),
    ),
    EffectEntry("logger_offset", "sensor", (_make_required("offset", "s"), _make_optional("interpolated", "1"))),
    EffectEntry("lost_samples", "sensor", (_make_required("fraction", "1"),)),
)
"""All effects of the vocabulary but `DISCOVERED_LAW`, by place: mechanism, hand, actuator, sensor. Units are SI, except
degrees and ppm."""

DISCOVERED_LAW = "discovered_law"
"""Name of an effect that is a formula with free parameters p0, p1, …; see `equalizer.laws`. Its place follows from the
quantity on which it acts (`LAW_PLACES`)."""
LAW_PLACES: dict[str, Place] = {"force": "mechanism", "command": "actuator", "response": "sensor"}
"""Place of a law by the quantity on which it acts (`equalizer.laws.law.ActsOn`)."""

EFFECTS_BY_NAME: dict[str, EffectEntry] = {effect.name: effect for effect in EFFECT_ENTRIES}
"""`EFFECT_ENTRIES` by the name of the effect."""
