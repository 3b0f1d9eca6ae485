"""Infers the quantity of responses without one: position, velocity or force, from their name where that is clear, else
from their relation to the command.

If the response is a position, the force balance needs its second derivative, unless the mass is negligible; if it is a
velocity, the mass belongs to the first derivative. So a response is taken as a position, or as a velocity where it is
significant itself and its second derivative is not. The same is done for a sensor's voltage.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from analysis.diagnosis.balance.motion import NoMotionError, motions_of
from analysis.diagnosis.balance.regression import regression_of
from analysis.diagnosis.data.measured_motion import is_driven
from analysis.diagnosis.data.observed_parts import observe_parts
from analysis.diagnosis.settings import DERIVATIVE_NEEDED
from analysis.wording import conjoin
from equalizer.plant.mechanical_model import DERIVATIVE_OF_QUANTITY
from equalizer.signals.recording import Recording
from equalizer.signals.units import UNSTATED

KNOWN = (frozenset(DERIVATIVE_OF_QUANTITY) | {"force", "torque"}) - {"voltage"}


def name_motion(recordings: tuple[Recording, ...]) -> tuple[tuple[Recording, ...], str]:
    """The recordings with their responses' quantity, and a sentence about it; empty where all was stated. recordings:
    alike in channels, units and rate."""
    first = recordings[0]
    if set(first.response.quantities) & KNOWN:
        return recordings, ""
    if named := _quantities_in_names(first):
        return tuple(_with_quantity(each, named) for each in recordings), _sentence_of_names(first, named)
    if not is_driven(recordings):
        if set(first.response.units) != {UNSTATED}:
            return recordings, ""
        return tuple(_with_quantity(each, "position") for each in recordings), (
            f"Nothing says what {conjoin(list(first.response.channels))} measures: it was taken for a position that "
            "moves freely; if it is a speed, say so in the map (quantity)."
        )
    moved = set(first.command.quantities) <= set(DERIVATIVE_OF_QUANTITY) - {"voltage"}
    quantity = "force" if moved else _likely_quantity(recordings)
    if quantity == "position" and set(first.response.quantities) == {"voltage"}:
        return recordings, ""
    names = conjoin(list(first.response.channels))
    return tuple(_with_quantity(each, quantity) for each in recordings), (
        f"Nothing says what {names} measures: it was taken for a {quantity}, as its time series suggests; if it is "
        "another, say so in the map (quantity)."
    )


def _quantities_in_names(recording: Recording) -> tuple[str, ...]:
    """Quantities of the responses, where a name determines one that nothing else determines; else empty."""
    from equalizer.signals.quantity_words import quantity_in  # only where a quantity is missing

    response = recording.response
    found = [
        named if unit == UNSTATED and (named := quantity_in(name)) in KNOWN else quantity
        for name, unit, quantity in zip(response.channels, response.units, response.quantities, strict=True)
    ]
    return tuple(found) if set(found) & KNOWN else ()


def _sentence_of_names(recording: Recording, quantities: Sequence[str]) -> str:
    taken = [
        f"{name} was taken for {'an' if quantity.startswith('a') else 'a'} {quantity}"
        for name, quantity in zip(recording.response.channels, quantities, strict=True)
        if quantity in KNOWN
    ]
    return f"By name alone, {conjoin(taken)}; if it is another, say so in the map (quantity)."


def _likely_quantity(recordings: Sequence[Recording]) -> str:
    """Quantity of the first response, judged against the first command; a position where it cannot be determined."""
    count = len(recordings[0].response.channels)
    taken = [replace(_with_quantity(each, "position"), position=None) for each in recordings]
    try:
        motions = motions_of(observe_parts(taken, count))
        regression = regression_of(motions, 0, (), turns=False)
    except (NoMotionError, np.linalg.LinAlgError):
        return "position"
    whole = regression.columns_of(())
    power = max(sum(block.signal for block in regression.fit), 1e-300)
    if not np.isfinite(motions[0].band_hz):
        return "position"

    def error_without(columns: Sequence[int]) -> float:
        """Increase of the cross-validated error without these columns, relative to the power."""
        without = regression.cross_validated_errors([k for k in whole if k not in columns])
        return float((without - regression.cross_validated_errors(whole)).sum()) / power

    d = len(motions[0].channels)
    second_derivative, itself = error_without(range(d)), error_without(range(2 * d, 3 * d))
    return "velocity" if second_derivative < DERIVATIVE_NEEDED <= itself else "position"


def _with_quantity(recording: Recording, quantity: str | tuple[str, ...]) -> Recording:
    return replace(recording, response=replace(recording.response, quantity=quantity))
