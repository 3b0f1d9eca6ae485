"""Plain words for the effects of the vocabulary and for laws that it lacks: nouns, places, units, and how their
parameters are printed.

For the sentences, tables and figures of a diagnosis.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

from analysis.diagnosis.document import Estimate
from analysis.diagnosis.unit_wording import format_percent, format_value
from equalizer.plant.effect_vocabulary import EFFECTS_BY_NAME, Place
from equalizer.signals.unit_system import UnitSystem

_VALUE_ALONE = "{}"
"""Format of a parameter that is printed without words."""


@dataclass(frozen=True, slots=True)
class EffectWords:
    """Words for an effect of the vocabulary, or for a law that it lacks: noun, and how parameters are printed."""

    noun: str
    """As in a sentence, with its article if it has one: "a sensor offset"."""
    parameters: Mapping[str, str] = field(default_factory=dict)
    """Format by parameter, "{}" for its value, in the order of printing; other parameters but "side" are not printed.
    Empty: the main parameter alone is printed, or the first one of a law outside the vocabulary."""
    shares: tuple[str, ...] = ()
    """Parameters that are printed in per cent."""


EFFECT_WORDS: Mapping[str, EffectWords] = {
    "coulomb_friction": EffectWords("dry friction"),
    "asymmetric_friction": EffectWords(
        "dry friction that differs with the direction",
        {"level_positive": "{} forwards", "level_negative": "{} backwards"},
    ),
    "stribeck_friction": EffectWords(
        "friction that is larger at rest (Stribeck)",
        {"coulomb": "{} in motion", "static": "{} at rest", "speed": "a transition over {}"},
    ),
    "position_dependent_friction": EffectWords(
        "dry friction that depends on the position",
        {"level": "{} at the centre", "slope_per_m": "growing by {}", "bend_per_m2": "bent by {}"},
    ),
    "presliding_hysteresis": EffectWords(
        "dry friction with elastic presliding",
        {"level": _VALUE_ALONE, "stiffness": "a stiffness of {} before it slides"},
    ),
    "viscous_damping": EffectWords("viscous damping"),
    "quadratic_damping": EffectWords("damping that grows with the square of the speed"),
    "hardening_stiffness": EffectWords("a spring that hardens with displacement"),
    "asymmetric_stiffness": EffectWords("a spring that is stiffer to one side"),
    "constant_force": EffectWords("a constant force"),
    "gravity_torque": EffectWords(
        "the weight of a body off its axis (a pendulum)", {"torque": _VALUE_ALONE, "angle": "hanging {} from zero"}
    ),
    "cogging": EffectWords(
        "a force ripple along the travel (cogging)", {"amplitude": _VALUE_ALONE, "pitch": "repeating every {}"}
    ),
    "backlash": EffectWords("play (backlash)", {"gap": "a gap of {}"}),
    "loose_joint": EffectWords(
        "a loose joint", {"gap": "a gap of {}", "stiffness": "a stiffness of {}", "slip": "slipping at {}"}
    ),
    "end_stop": EffectWords("an end stop", {"position": "met at {}", "stiffness": "a stiffness of {}"}),
    "pose_dependent_inertia": EffectWords("inertia that changes with the position", {"per_m": _VALUE_ALONE}),
    "extra_mode": EffectWords(
        "a resonance that the model lacks",
        {"frequency": "at {}", "mass": "carrying {}", "damping_ratio": "damping ratio {}"},
    ),
    "added_mass": EffectWords("an added mass"),
    "hand_impedance": EffectWords(
        "the impedance of a hand", {"mass": _VALUE_ALONE, "damping": _VALUE_ALONE, "stiffness": _VALUE_ALONE}
    ),
    "time_varying_grip": EffectWords("a grip that varies in time", {"rate_hz": "at {}", "depth": "by {}"}, ("depth",)),
    "body_on_actuator": EffectWords(
        "a body attached to the actuator by a spring and a damper",
        {"mass": _VALUE_ALONE, "damping": _VALUE_ALONE, "stiffness": _VALUE_ALONE},
    ),
    "force_saturation": EffectWords("force saturation", {"limit": "at {}"}),
    "force_deadband": EffectWords("a dead band of the force", {"width": "± {}"}),
    "slew_limit": EffectWords("a limited rate of change of the command", {"rate": "at most {}"}),
    "amplifier_lag": EffectWords("a lag of the amplifier", {"time_constant": "time constant {}"}),
    "transport_delay": EffectWords("a delay of the command"),
    "force_gain": EffectWords("a wrong force gain", {"gain": "a factor of {}"}),
    "force_nonlinearity": EffectWords(
        "a force that is not proportional to its command", {"square": "{} of it with the square"}
    ),
    "sensor_lag": EffectWords("a low pass in the sensor", {"bandwidth": "at {}"}),
    "sensor_clipping": EffectWords("clipping in the sensor", {"limit": "at {}"}),
    "sensor_misalignment": EffectWords("a misaligned sensor"),
    "cross_axis_sensitivity": EffectWords(
        "cross-axis sensitivity of the sensor",
        {"from_next": "{} of the next axis", "from_after_next": "{} of the one after it"},
        ("from_next", "from_after_next"),
    ),
    "sensor_gain": EffectWords("a wrong sensor gain", {"gain": "a factor of {}"}),
    "sensor_nonlinearity": EffectWords("a nonlinear sensor", {"cubic": "cubic term {}"}),
    "sensor_offset": EffectWords("a sensor offset"),
    "sensor_drift": EffectWords("a drift of the sensor", {"total": "{} in all"}),
    "quantization": EffectWords("rounding to steps (quantisation)", {"step": "steps of {}"}),
    "mains_hum": EffectWords("mains hum", {"amplitude": _VALUE_ALONE, "frequency": "at {}"}),
    "clock_drift": EffectWords("drift between the clocks", {"ppm": _VALUE_ALONE}),
    "logger_offset": EffectWords("a delay of the logger", {"offset": _VALUE_ALONE}),
    "lost_samples": EffectWords("lost samples", {"fraction": "{} of all"}, ("fraction",)),
}
"""Words by name of the effect in the vocabulary."""


@dataclass(frozen=True, slots=True)
class LawWords:
    """Words, units and place of a law that the vocabulary lacks."""

    words: EffectWords
    """Its noun, and how its parameters are printed."""
    units: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    """SI units by parameter, of a translational and of a rotational model."""
    place: Place = "mechanism"
    """Component at which it acts."""


_FORCE, _DAMPING, _STIFFNESS = ("N", "N m"), ("N s/m", "N m s/rad"), ("N/m", "N m/rad")
"""SI units of a translational and of a rotational model."""
_CHANGE = "by {} from the middle to the end"
"""Format of a change during a recording."""
_PER_CONDITION = "{} per standard deviation of the condition"
"""Format of the change of a law with a recorded condition."""
LAW_WORDS: Mapping[str, LawWords] = {
    "viscoelastic_relaxation": LawWords(
        EffectWords(
            "viscoelastic relaxation of a spring",
            {"stiffness": _VALUE_ALONE, "time_constant": "time constant {}"},
        ),
        {"stiffness": _STIFFNESS, "time_constant": ("s", "s")},
    ),
    "drifting_friction": LawWords(
        EffectWords("dry friction that changes during the recording", {"level": _VALUE_ALONE, "change": _CHANGE}),
        {"level": _FORCE, "change": _FORCE},
    ),
    "drifting_damping": LawWords(
        EffectWords("damping that changes during the recording", {"change": _CHANGE}), {"change": _DAMPING}
    ),
    "drifting_force": LawWords(
        EffectWords("a force that drifts during the recording", {"change": _CHANGE}), {"change": _FORCE}
    ),
    "condition_dependent_friction": LawWords(
        EffectWords(
            "dry friction that depends on the recorded condition", {"level": _VALUE_ALONE, "change": _PER_CONDITION}
        ),
        {"level": _FORCE, "change": _FORCE},
    ),
    "condition_dependent_force": LawWords(
        EffectWords("a force that depends on the recorded condition", {"change": _PER_CONDITION}),
        {"change": _FORCE},
    ),
    "condition_dependent_damping": LawWords(
        EffectWords("damping that depends on the recorded condition", {"change": _PER_CONDITION}),
        {"change": _DAMPING},
    ),
    "condition_dependent_stiffness": LawWords(
        EffectWords("stiffness that depends on the recorded condition", {"change": _PER_CONDITION}),
        {"change": _STIFFNESS},
    ),
    "actuator_cubic": LawWords(
        EffectWords("an actuator whose gain changes with the square of the command"), place="actuator"
    ),
    "actuator_asymmetry": LawWords(
        EffectWords("an actuator that pushes more to one side than to the other"), place="actuator"
    ),
    "actuator_curve": LawWords(
        EffectWords("a force that grows with a power of its command", {"width": "beyond {}", "power": "power {}"}),
        {"width": _FORCE, "power": ("1", "1")},
        "actuator",
    ),
    "electromagnet": LawWords(
        EffectWords("a force that falls with the square of the distance (electromagnet)", {"gap": "{} at the nearest"}),
        {"gap": ("m", "rad")},
        "actuator",
    ),
    "added_stiffness": LawWords(EffectWords("an added spring", {"stiffness": _VALUE_ALONE}), {"stiffness": _STIFFNESS}),
    "force_offset": LawWords(
        EffectWords("an offset of the force", {"offset": _VALUE_ALONE}), {"offset": _FORCE}, place="actuator"
    ),
    "force_gain_drift": LawWords(
        EffectWords("a force gain that drifts", {"change": "by {} from beginning to end"}, shares=("change",)),
        place="actuator",
    ),
    "force_quantization": LawWords(
        EffectWords("a command in steps", {"step": "of {}"}), {"step": _FORCE}, place="actuator"
    ),
    "sensor_noise": LawWords(EffectWords("a noisier sensor", {"rms": "by {} rms"}), {}, place="sensor"),
    "sensor_play": LawWords(EffectWords("play before the sensor", {"gap": "a gap of {}"}), {}, place="sensor"),
    "sensor_asymmetry": LawWords(EffectWords("a sensor that reads more to one side (square)"), place="sensor"),
}
"""Laws of the force balance, and faults found by comparison with clean recordings, that the catalogue lacks."""

SIMULATED_AS_FORMULA = (
    "actuator_curve", "condition_dependent_friction", "condition_dependent_damping", "condition_dependent_stiffness",
    "condition_dependent_force",
)  # fmt: skip
"""Laws of `LAW_WORDS` that are simulated as a discovered law, by their formula."""

WHOLE_DEVICE_FAULTS = ("sensor_misalignment", "cross_axis_sensitivity", "clock_drift", "logger_offset", "lost_samples")
"""Faults of the whole sensor or logger, for which no place is named where all channels share them."""

_PLACE_PHRASES: Mapping[str, tuple[str, str]] = {
    "mechanism": ("on the {} drive", "on all drives"),
    "actuator": ("in the {} actuator", "in all actuators"),
    "sensor": ("in the {} channel", "in all channels"),
}
"""Phrases for one axis or channel and for all, by place."""


def get_noun(effect: str) -> str:
    """Return the plain noun of an effect; its name with spaces for underscores where it has none."""
    words = _find_words(effect)
    return words.noun if words else effect.replace("_", " ")


def get_place(effect: str) -> Place:
    """Return the place (mechanism, actuator, sensor or hand) at which an effect of the vocabulary, or a law outside it,
    acts; "mechanism" for an unknown name."""
    catalogue_entry = EFFECTS_BY_NAME.get(effect)
    law_words = LAW_WORDS.get(effect)
    return (
        catalogue_entry.place if catalogue_entry is not None else "mechanism" if law_words is None else law_words.place
    )


def _find_words(effect: str) -> EffectWords | None:
    """Find the words for an effect of the vocabulary or a law of `LAW_WORDS`; None for any other name."""
    law_words = LAW_WORDS.get(effect)
    return EFFECT_WORDS.get(effect) if law_words is None else law_words.words


def get_parameter_unit(effect: str, parameter: str, system: UnitSystem, reading_unit: str = "1") -> str:
    """Return the unit of an effect's parameter in the unit system; "1" where it is not known. reading_unit: of the
    sensor's reading; "1" where it is not known."""
    law = LAW_WORDS.get(effect)
    if law is not None and law.place == "sensor":
        return reading_unit if parameter in law.words.parameters else "1"
    if law is not None:
        linear_unit, rotational_unit = law.units.get(parameter, ("1", "1"))
        return rotational_unit if system.rotational else system.express(linear_unit)
    entry = EFFECTS_BY_NAME.get(effect)
    matching = (known for known in (() if entry is None else entry.parameters) if known.name == parameter)
    return next((known.find_unit(system, reading_unit) for known in matching), "1")


def format_place(place: Place, axis: str | None, is_single_axis: bool = False) -> str:
    """Describe where an effect acts, in words. axis: its axis or channel; None = all. is_single_axis: the device has
    one axis, so that None means this one, and the hand needs no axis."""
    if place == "hand":
        return "at the handle" if axis is None or is_single_axis else f"at the handle, along {axis}"
    one_place, all_places = _PLACE_PHRASES[place]
    if axis is None:
        return one_place.format("").replace("  ", " ") if is_single_axis else all_places
    return one_place.format(axis)


def format_parameters(effect: str, parameters: Mapping[str, Estimate]) -> str:
    """Format the parameters of an effect, as "0.15 N [0.14, 0.16] in motion, 0.21 N [0.19, 0.23] at rest". An effect
    without words for them: its main parameter, or the first one where the vocabulary lacks the effect. A parameter
    "side" is added as a direction."""
    effect_words = _find_words(effect)
    format_by_parameter = dict(effect_words.parameters) if effect_words else {}
    if not format_by_parameter:
        main_parameter = (EFFECTS_BY_NAME[effect].main.name,) if effect in EFFECTS_BY_NAME else tuple(parameters)[:1]
        format_by_parameter = dict.fromkeys(main_parameter, _VALUE_ALONE)
    percent_parameters = effect_words.shares if effect_words else ()
    parameter_texts = [
        parameter_format.format(format_estimate(parameters[name], name in percent_parameters))
        for name, parameter_format in format_by_parameter.items()
        if name in parameters
    ]
    if "side" in parameters:
        parameter_texts.append(f"reached in the {'positive' if parameters['side'].value > 0 else 'negative'} direction")
    return ", ".join(parameter_texts)


def format_estimate(estimate: Estimate, is_percent: bool = False) -> str:
    """Format an estimate with its unit and 95 % interval. is_percent: print it in per cent."""
    if is_percent:
        return format_percent(estimate.value, estimate.ci95)
    return format_value(estimate.value, estimate.unit, estimate.ci95)
