"""Sentences that doubt a unit or a sign: a channel differs from the model's prediction by a constant factor only, or
the command is not a force.

A wrong unit or reversed wiring is more likely than a device with such a response. Thresholds: `UNIT_FACTOR` on the
ratio of amplitudes, `UNIT_CORRELATION` on the correlation coefficient.
"""

from collections.abc import Sequence

import numpy as np

from analysis.diagnosis.result.findings import TimeSeries
from analysis.diagnosis.settings import UNIT_CORRELATION, UNIT_FACTOR
from equalizer.plant.mechanical_model import MechanicalModel


def unit_sentences(time_series: Sequence[TimeSeries]) -> tuple[str, ...]:
    """A sentence for each channel that differs from the given model's prediction by a factor of `UNIT_FACTOR` or more,
    or by its sign, while both correlate well."""
    factors: dict[str, float] = {}
    for series in time_series:
        for channel, name in enumerate(series.channels):
            factor = _factor(series, channel)
            if factor is not None and not 1 / UNIT_FACTOR < factor < UNIT_FACTOR:
                factors.setdefault(name, factor)
    return tuple(
        f"{name} has the shape that the model predicts, but {_words(factor)}: its {_sign_or_unit(factor)}, the "
        "command's or one in the model may be wrong."
        for name, factor in factors.items()
    )


def _factor(series: TimeSeries, channel: int) -> float | None:
    """Ratio of the measured to the predicted rms, both without their means, with the sign of the correlation; None
    where the correlation is below `UNIT_CORRELATION` in magnitude, a signal is constant, or no sample is finite."""
    measured, predicted = series.measured[:, channel], series.before[:, channel]
    is_known = np.isfinite(measured) & np.isfinite(predicted)
    if not is_known.any():
        return None
    measured_part, predicted_part = (signal[is_known] - np.mean(signal[is_known]) for signal in (measured, predicted))
    sizes = float(np.sqrt(measured_part @ measured_part)), float(np.sqrt(predicted_part @ predicted_part))
    covariance = float(measured_part @ predicted_part)
    if min(sizes) == 0 or not np.isfinite(sizes).all() or abs(covariance) < UNIT_CORRELATION * sizes[0] * sizes[1]:
        return None
    return float(np.copysign(sizes[0] / sizes[1], covariance))


def _words(factor: float) -> str:
    """The factor in words: "12 times as large and with the other sign"."""
    times = max(abs(factor), 1 / abs(factor))
    text = f"{times:.3g}" if times < 100 else f"{times:.0f}"
    texts = [f"{text} times {'as large' if abs(factor) > 1 else 'smaller'}"] if times >= UNIT_FACTOR else []
    return " and ".join([*texts, *(["with the other sign"] if factor < 0 else [])])


def _sign_or_unit(factor: float) -> str:
    """What may be wrong: the sign where the magnitude is plausible, else the unit."""
    return "sign" if -UNIT_FACTOR < factor < -1 / UNIT_FACTOR else "unit"


def constant_sentence(model: MechanicalModel) -> str:
    """A sentence about the unit of forces, masses, damping and stiffness where commands have no known conversion to
    force or torque; empty for a known unit system."""
    system = model.system
    if system.known:
        return ""
    text = "has no unit" if system.force == "1" else f"is in {system.force}"
    effort = {"m": ("force", "N"), "rad": ("torque", "N m")}.get(system.length)
    if effort is None:
        motion = "has no unit" if system.length == "1" else f"is in {system.length}"
        return (
            f"The command {text}, and the motion {motion}: forces, masses and stiffnesses are given in these units "
            "and not in N or kg."
        )
    per = "" if system.force == "1" else f" per {system.force}"
    return (
        f"The command {text}, and the {effort[0]} that it produces is not known: every {effort[0]}, mass, damping and "
        f"stiffness must be multiplied by the {effort[0]} constant ({effort[1]}{per}); state it with --force-constant."
    )
