"""Discovered law as an effect: a formula that is added to the force at an axis, or replaces a command or a response.

A law (`equalizer.laws.law`) is found in recordings (`analysis.diagnosis.discovery`) or written in a model file.
`make_law_effect` binds the signals of its formula (x, vx, ax, fx, t, channel names) to the columns of a recording,
compiles it, and derives the fit parameters p0, p1, … from their roles in the formula.
"""

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from keyword import iskeyword

import numpy as np

from equalizer.effects.effect import Action, AxisForce, Effect, OnCommand, OnResponse, Parameter, Values
from equalizer.effects.simulation.law_kernel import SIGNALS_PER_AXIS, compute_law_force
from equalizer.laws.evaluate import evaluate, evaluate_held
from equalizer.laws.law import Law, Role, find_parameter_roles
from equalizer.laws.parse import FUNCTIONS, MEMORY_OPERATORS
from equalizer.laws.program import STACK_SIZE, compile_program
from equalizer.laws.tree import Apply, Node, Variable, iterate_nodes
from equalizer.laws.units import DIMENSIONLESS, FORCE, SECOND, compute_motion_dimension, derive_units
from equalizer.plant.effect_vocabulary import DISCOVERED_LAW
from equalizer.plant.mechanical_model import DERIVATIVE_OF_QUANTITY, MechanicalModel
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray
from equalizer.signals.unit_system import UnitSystem

AXIS_LETTERS, DERIVATIVE_PREFIXES, COMMAND_PREFIX = "xyz", ("", "v", "a"), "f"
"""Letters of the axes, and prefixes of position, velocity, acceleration and command: x, vx, ax, fx."""
_RESERVED_NAMES = {
    "t",
    "pi",
    "q",
    "v",
    "f",
    *FUNCTIONS,
    *(prefix + letter for letter in AXIS_LETTERS for prefix in (*DERIVATIVE_PREFIXES, COMMAND_PREFIX)),
}
"""Names that a recorded condition cannot have in a formula, because they have another meaning (as have p0, c1, …)."""
LARGEST_PARAMETER, LARGEST_EXPONENT = 1e15, 20.0
"""Largest magnitude of a free parameter, and of an exponent. Chosen."""


@dataclass(frozen=True, slots=True)
class Channels:
    """Channel names of a recording's commands, responses and conditions."""

    inputs: tuple[str, ...] = ("fx", "fy", "fz")
    """Names of the command channels, one per driven axis."""
    outputs: tuple[str, ...] = ("ax", "ay", "az")
    """Names of the response channels."""
    quantity: str = "acceleration"
    """Quantity of the response."""
    conditions: tuple[str, ...] = ()
    """Names of the recorded conditions."""


def collect_channels(recording: Recording) -> Channels:
    """Collect the names by which laws call a recording's signals; quantity: that of the first response channel."""
    response, condition = recording.response, recording.condition
    return Channels(
        recording.command.channels, response.channels, response.quantities[0], condition.channels if condition else ()
    )


def make_law_effect(law: Law, channels: Channels = Channels()) -> Effect:
    """Make the effect of a law, to be placed at the axis (force, command) or channel (response) that `law.axis` names.
    Its values are p0, p1, …

    A formula names its signals by axis and quantity (x, vx, ax, fx; y, …; letters: `derive_axis_letters`) or by the
    recording's channel names. The effect has no starting values. Raises LawError for a signal that the recording lacks.
    """
    action_makers: dict[str, Callable[[Law, Channels], Action]] = {
        "force": _make_force_action, "command": _make_command_action, "response": _make_response_action
    }  # fmt: skip
    conditions = set(name_conditions(channels))
    reads_conditions = law.acts_on == "force" and not conditions.isdisjoint(law.variables)
    return Effect(
        name=DISCOVERED_LAW,
        equation=f"{_format_left_hand_side(law)} {law.text}",
        source="found in these recordings",
        signature=f"it depends on {', '.join(law.variables) or 'nothing'} as the formula states",
        parameters=make_law_parameters(law),
        action=action_makers[law.acts_on](law, channels),
        starts=lambda evidence, axis: (),
        law=law,
        of_time="t" in law.variables or reads_conditions,
        with_conditions=partial(_make_force_action, law, channels) if reads_conditions else None,
    )


def name_conditions(channels: Channels) -> tuple[str, ...]:
    """Name the recorded conditions as a formula calls them: by their channel names where these are valid and not taken
    by another signal, else c1, c2, … in their order."""
    conditions, signal_names = channels.conditions, (*channels.inputs, *channels.outputs)
    return tuple(
        name if _is_usable_name(name) and name not in signal_names and conditions.count(name) == 1 else f"c{position}"
        for position, name in enumerate(conditions, 1)
    )


def _is_usable_name(name: str) -> bool:
    """Whether a condition's channel name is valid in a formula and has no other meaning there."""
    is_reserved = iskeyword(name) or name in _RESERVED_NAMES or re.fullmatch(r"[pc]\d+", name)
    return name.isidentifier() and not is_reserved


def derive_law_units(law: Law, channels: Channels, system: UnitSystem) -> tuple[str, ...]:
    """Derive the units of the law's free parameters: those that the law states, else by dimensional analysis in the
    given unit system."""
    if law.units:
        return law.units
    order = DERIVATIVE_OF_QUANTITY.get(channels.quantity, 0)
    motion = [compute_motion_dimension(derivative) for derivative in range(len(DERIVATIVE_PREFIXES))]
    dimensions = {
        "t": SECOND,
        **dict.fromkeys(channels.outputs, motion[order]),
        **dict.fromkeys(channels.inputs, FORCE),
    }
    for letter in AXIS_LETTERS:
        dimensions |= {prefix + letter: motion[derivative] for derivative, prefix in enumerate(DERIVATIVE_PREFIXES)}
        dimensions[COMMAND_PREFIX + letter] = FORCE
    # A formula divides a condition by its own unit, so conditions are counted in that unit.
    dimensions = dict.fromkeys(law.variables, DIMENSIONLESS) | dimensions
    return derive_units(
        law.tree, law.numbers, dimensions, motion[order] if law.acts_on == "response" else FORCE, system
    )


def get_law_values(law: Law) -> Values:
    """Return the values p0, p1, … of the law's effect: the law's free parameters in their order, in SI units."""
    return {f"p{number}": value for number, value in enumerate(law.numbers)}


def set_law_values(law: Law, values: Values) -> Law:
    """Return the law with the values p0, p1, … as its free parameters; the inverse of `get_law_values`."""
    return law.replace_numbers([values[f"p{number}"] for number in range(len(law.numbers))])


def make_law_parameters(law: Law) -> tuple[Parameter, ...]:
    """Make the fit parameters p0, p1, …, with range and scale by each parameter's role in the formula and its sign."""
    parameter_roles = find_parameter_roles(law.tree)
    vanishing_value = 0.0 if law.acts_on == "force" or _adds_to_signal(law.tree) else None
    return tuple(
        _make_parameter(f"p{index}", value, parameter_roles[index], vanishing_value)
        for index, value in enumerate(law.numbers)
    )


def _adds_to_signal(tree: Node) -> bool:
    """Whether the formula is a signal plus or minus terms, so that its factors can vanish; the signal is taken for that
    on which the law acts."""
    while isinstance(tree, Apply) and tree.name in ("+", "-"):
        tree = tree.arguments[0]
    return isinstance(tree, Variable)


def _make_parameter(name: str, value: float, role: Role, vanishing_value: float | None) -> Parameter:
    """Make the fit parameter of a role (`equalizer.laws.law.Role`), with chosen ranges. vanishing_value: value at which
    a factor makes the effect vanish; None: at none."""
    if role == "factor":
        return Parameter(name, -LARGEST_PARAMETER, LARGEST_PARAMETER, vanishing_value, scale="signed")
    if role == "phase":
        return Parameter(name, -1e3, 1e3, None, scale="linear", step=0.02)
    if role == "exponent":
        return (
            Parameter(name, 1e-3, LARGEST_EXPONENT, None)
            if value > 0
            else Parameter(name, -LARGEST_EXPONENT, LARGEST_EXPONENT, None, "linear")
        )
    if role == "positive" and value > 0:
        return Parameter(name, 1 / LARGEST_PARAMETER, LARGEST_PARAMETER, None)
    return Parameter(name, -LARGEST_PARAMETER, LARGEST_PARAMETER, None, scale="signed")


def _format_left_hand_side(law: Law) -> str:
    """Format the left-hand side of the equation: the quantity on which the law acts."""
    return {"force": "F =", "command": f"command on {law.axis} =", "response": f"response {law.axis} ="}[law.acts_on]


def has_memory(law: Law) -> bool:
    """Whether the formula has an operator with memory (`MEMORY_OPERATORS`)."""
    return any(isinstance(node, Apply) and node.name in MEMORY_OPERATORS for node in iterate_nodes(law.tree))


def derive_axis_letters(channels: tuple[str, ...]) -> tuple[str, ...]:
    """Derive the letters of the axes in a formula: the last letters of the channel names where these are distinct and
    in "xyz", else x, y, z for the first three channels."""
    last_letters = tuple(channel[-1:] for channel in channels)
    if len(set(last_letters)) == len(last_letters) and set(last_letters) <= set(AXIS_LETTERS):
        return last_letters
    return tuple(AXIS_LETTERS[: len(channels)])


def list_response_signals(channels: Channels) -> tuple[str, ...]:
    """List the names of the response's channels in a formula: by quantity and axis (ax, ay, az), or channel names."""
    name_by_column: dict[int, str] = {}
    for name, column in _index_response_signals(channels).items():
        name_by_column.setdefault(column, name)
    return tuple(name_by_column[column] for column in sorted(name_by_column))


def index_force_signals(channels: Channels) -> dict[str, int]:
    """List the index of each signal in the compiled law's input: time, then position, velocity, acceleration and
    command of each axis, then the conditions."""
    first_condition = 1 + SIGNALS_PER_AXIS * len(channels.inputs)
    conditions = {name: index for index, name in enumerate(name_conditions(channels), first_condition)}
    signals = [("t", 0), *((name, 1 + index) for name, index in _iterate_motion_signals(channels))]
    # A channel's name replaces none of the names t, x, vx, ax, fx, which come first.
    reserved = signals[: 1 + SIGNALS_PER_AXIS * len(derive_axis_letters(channels.inputs))]
    return conditions | dict(signals) | dict(reserved)


def _iterate_motion_signals(channels: Channels) -> Iterator[tuple[str, int]]:
    """Iterate over the names of the axes' signals, by letters first, and their indices after the time; response
    channels are named only where there is one per axis, of a quantity in `DERIVATIVE_OF_QUANTITY`."""
    order = DERIVATIVE_OF_QUANTITY.get(channels.quantity)
    for axis, letter in enumerate(derive_axis_letters(channels.inputs)):
        for signal_index, prefix in enumerate((*DERIVATIVE_PREFIXES, COMMAND_PREFIX)):
            yield prefix + letter, SIGNALS_PER_AXIS * axis + signal_index
    if order is not None and len(channels.outputs) == len(channels.inputs):
        yield from ((name, SIGNALS_PER_AXIS * axis + order) for axis, name in enumerate(channels.outputs))
    for axis, name in enumerate(channels.inputs):
        yield name, SIGNALS_PER_AXIS * axis + len(DERIVATIVE_PREFIXES)


def _make_force_action(
    law: Law, channels: Channels, samples: FloatArray | None = None, rate_hz: float = 0.0
) -> AxisForce:
    """Make the action of a force law on m axes. samples: (n, q), the recorded conditions at `rate_hz`, each held until
    the next; None = unknown. The action's `pack` raises ValueError for a model with another number of axes, and for
    missing conditions."""
    signals = index_force_signals(channels)
    program, m, q = (compile_program(law.tree, signals), len(channels.inputs), len(channels.conditions))
    signal_indices = {signals[name] for name in law.variables if name not in ("t", "pi")}
    reads_acceleration = any(
        (index - 1) % SIGNALS_PER_AXIS == 2 for index in signal_indices if index <= SIGNALS_PER_AXIS * m
    )
    reads_conditions = any(index > SIGNALS_PER_AXIS * m for index in signal_indices)
    condition_samples = np.empty((0, q)) if samples is None else samples

    def pack(model: MechanicalModel, axis: int, values: Values) -> FloatArray:
        """Pack the parameters of `compute_law_force`: header, samples of the conditions, program."""
        if model.inputs != m:
            raise ValueError(f"the law {law.text} is for {m} axes; the model has {model.inputs}")
        if reads_conditions and not len(condition_samples):
            raise ValueError(
                f"the law {law.text} needs conditions that were not recorded; record them, or leave the law out"
            )
        header = [m, reads_acceleration, q if len(condition_samples) else 0, len(condition_samples), rate_hz]
        numbers = program.insert_numbers(set_law_values(law, values).numbers)
        return np.concatenate([header, condition_samples.ravel(), numbers])

    memory = STACK_SIZE + 1 + SIGNALS_PER_AXIS * m + q + program.memory_size
    return AxisForce(compute_law_force, pack, memory=memory, acceleration=reads_acceleration, reads_all_axes=True)


def _make_command_action(law: Law, channels: Channels) -> OnCommand:
    """Make the action of a law that replaces the command of its axis. Raises LawError for a signal that is
    neither a command nor the time."""
    letters = {COMMAND_PREFIX + letter: axis for axis, letter in enumerate(derive_axis_letters(channels.inputs))}
    signals = letters | {name: axis for axis, name in enumerate(channels.inputs) if name not in letters}
    # Compiled only to raise LawError now, not in the first simulation: the columns, such as -1 of t, are not read.
    compile_program(law.tree, {**signals, "t": -1})

    def compute_force(
        commands: FloatArray, channel: int, step_s: float, values: Values
    ) -> tuple[FloatArray, FloatArray]:
        """Compute the law in place of the command: `OnCommand.of_all`."""
        signal_values = {name: commands[:, channel_index] for name, channel_index in signals.items()}
        step_values = evaluate_held(set_law_values(law, values), signal_values, 1 / step_s)
        return np.asarray(step_values.mean(axis=0)), step_values[1]

    return OnCommand(lambda commands, step_s, values: commands, fine=has_memory(law), of_all=compute_force)


def _make_response_action(law: Law, channels: Channels) -> OnResponse:
    """Make the action of a law that replaces its response channel. Raises LawError for a signal that is neither
    a response channel nor the time."""
    signals = _index_response_signals(channels)
    compile_program(law.tree, {**signals, "t": -1})

    def change(response: FloatArray, sample_rate_hz: float, sites: tuple[int, ...], values: Values) -> FloatArray:
        """Replace the channel by the law: `OnResponse.change`."""
        new_response = response.copy()
        signal_values = {name: response[:, column] for name, column in signals.items()}
        new_response[:, list(sites)] = evaluate(set_law_values(law, values), signal_values, sample_rate_hz)[:, None]
        return new_response

    return OnResponse(change)


def _index_response_signals(channels: Channels) -> Mapping[str, int]:
    """List the column in the response of each name in a formula; a channel's own name counts, as in older files."""
    order = DERIVATIVE_OF_QUANTITY.get(channels.quantity)
    letters = derive_axis_letters(channels.outputs) if order is not None else ()
    derivative_names = {DERIVATIVE_PREFIXES[order or 0] + letter: column for column, letter in enumerate(letters)}
    return derivative_names | {name: column for column, name in enumerate(channels.outputs)}
