"""Makes a linear model of a force balance: one body per command."""

from collections.abc import Sequence

import numpy as np

from analysis.diagnosis.balance.judge_laws import Balance
from analysis.diagnosis.balance.motion import Motion
from analysis.diagnosis.first_model.reduced_recordings import is_reduced
from analysis.diagnosis.settings import FOUND_NUMBERS_OPEN, MASSLESS_SHARE
from equalizer.plant.mechanical_model import ActuatorLimits, MechanicalModel, MechanicalModelError, Tolerance
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray


def first_model(balances: Sequence[Balance], recording: Recording, name: str) -> MechanicalModel | None:
    """A linear model with the masses, dampers and springs of force balances. recording: what `reduce_recordings` makes
    of it, where the balances hold more than one body per command. None where not each command drives one measured
    motion. Raises MechanicalModelError."""
    regressions = [balance.search.regression for balance in balances]
    count = len(balances)
    if count > len(regressions[0].motions[0].channels) or count != len(recording.response.channels):
        return None
    places = [regression.beside.own for regression in regressions]
    plain, full = (
        [_numbers(balance, laws, places) for balance, laws in zip(balances, kinds, strict=True)]
        for kinds in (
            [()] * count,
            [tuple(law.place for law in balance.named if law.place >= 0) for balance in balances],
        )
    )
    matrices = [np.array([row[part] for row in plain]) for part in range(3)]
    beside = [np.array([row[part] for row in full]) for part in range(3)]
    mass, damping, stiffness = ((each + each.T) / 2 for each in matrices)
    floor = MASSLESS_SHARE * _rms(np.vstack([each.force for each in regressions[0].motions]))
    moved = [np.gradient(each.velocity[:, places], 1 / each.rate_hz, axis=0) for each in regressions[0].motions]
    floor = floor / np.maximum(_rms(np.vstack(moved)), 1e-300)
    mass = mass + np.diag(np.maximum(floor - np.diagonal(mass), 0.0))
    spread = [
        float(np.max(np.abs(given - full)) / 2 + FOUND_NUMBERS_OPEN * np.abs(given).max())
        for given, full in zip((mass, damping, stiffness), beside, strict=True)
    ]
    return MechanicalModel(
        name,
        recording.response.quantities[0],
        mass,
        damping,
        stiffness,
        np.eye(count),
        np.eye(count),
        tolerance=Tolerance(max(spread[0], 1e-12), max(spread[1], 1e-12), max(spread[2], 1e-12), None),
        actuator=ActuatorLimits(delay_s=_common_delay_s(balances)),
        rotational=recording.is_rotational,
    )


def _common_delay_s(balances: Sequence[Balance]) -> float:
    """The delay of all commands where the reduced recordings do not contain it; 0 where the commands have different
    ones, because a model has a single delay."""
    delays = {balance.search.regression.beside.delay_s for balance in balances}
    return delays.pop() if len(delays) == 1 and not is_reduced(balances) else 0.0


def plain_model(balances: Sequence[Balance], recording: Recording, name: str) -> MechanicalModel | None:
    """`first_model` where laws are named along the motions of one body per command: then it needs no other fit."""
    if not any(balance.named for balance in balances) or is_reduced(balances):
        return None
    try:
        return first_model(balances, recording, name)
    except (MechanicalModelError, np.linalg.LinAlgError):
        return None


def share_within(balances: Sequence[Balance], band_hz: float) -> float:
    """Share of a named law's force power below a frequency; the least over the laws."""
    shares = [1.0]
    for balance in balances:
        regression = balance.search.regression
        laws = [law.place for law in balance.named if law.place >= 0]
        weights, begin = regression.weights(regression.columns_of(laws)), regression.base
        for place in (regression.places[law] for law in laws):
            own = weights[begin : begin + place.stop - place.start]
            begin += len(own)
            shares.append(
                _mean_force([rows[:, place] @ own for rows in regression.columns], regression.motions, band_hz)
            )
    return min(shares)


def _mean_force(forces: Sequence[FloatArray], motions: Sequence[Motion], band_hz: float) -> float:
    """The mean over all recordings is subtracted: where each runs one way, the friction differs between recordings at
    frequency zero."""
    within, whole, mean = 0.0, 1e-300, float(np.mean(np.concatenate(forces)))
    for force, motion in zip(forces, motions, strict=True):
        power = np.abs(np.fft.rfft(force - mean)) ** 2
        frequency_hz = np.fft.rfftfreq(len(force), motion.step / motion.rate_hz)
        within, whole = within + float(power[frequency_hz <= band_hz].sum()), whole + float(power.sum())
    return within / whole


def _numbers(balance: Balance, laws: Sequence[int], places: Sequence[int]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Rows of the mass, damping and stiffness matrices for the motions at these places."""
    regression = balance.search.regression
    weights = regression.weights(regression.columns_of(laws))[: regression.matrices]
    d = len(regression.motions[0].channels)
    rows = [*weights.reshape(-1, d)[:, list(places)], np.zeros(len(places))]
    return rows[0], rows[1], rows[2]


def _rms(samples: FloatArray) -> FloatArray:
    return np.asarray(np.sqrt(np.mean((samples - samples.mean(axis=0)) ** 2, axis=0)))
