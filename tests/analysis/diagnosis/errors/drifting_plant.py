"""A mass with Coulomb friction that drifts or is held by a controller, stepped by equations of this file."""

import numpy as np

from analysis.diagnosis.diagnose import diagnose
from analysis.diagnosis.diagnosis_settings import DiagnosisSettings
from equalizer.effects.catalogue import CATALOGUE
from equalizer.plant.mechanical_model import MechanicalModel, Tolerance
from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import Signal

RATE_HZ, FINE = 500.0, 20

MASS, DRAG, LEVEL, NOISE = 4.0, 12.0, 3.0, 2e-6

KP, KV = 900.0, 160.0


def make_model(stiffness: float = 0.0, quantity: str = "position") -> MechanicalModel:
    one = [[1.0]]
    loose = Tolerance(0.1, 2.0, 1.0, None)
    return MechanicalModel("carriage", quantity, [[4.05]], [[13.0]], [[stiffness]], one, one, tolerance=loose)


def random_course(seconds: float, seed: int) -> np.ndarray:
    """A smooth random force or place, (n,), rms 1, with rests at its ends."""
    rng = np.random.default_rng(seed)
    t = np.arange(int(seconds * RATE_HZ)) / RATE_HZ
    waves = [np.sin(2 * np.pi * hz * t + rng.uniform(0, 6)) / hz**0.5 for hz in (0.3, 0.7, 1.1, 1.9, 3.1)]
    whole = np.sum(waves, axis=0)
    return whole / whole.std() * np.clip(np.minimum(t, t[::-1]) / 0.4, 0, 1)


def simulate_plant(drive: np.ndarray, controlled: bool, level: float = LEVEL) -> tuple[np.ndarray, np.ndarray]:
    """Position and force, (n,) each. drive: the force, or the place that a controller aims at."""
    x = v = 0.0
    positions, forces, step = np.empty(len(drive)), np.empty(len(drive)), 1 / RATE_HZ / FINE
    for k, aim in enumerate(drive):
        positions[k] = x
        force = KP * (aim - x) - KV * v if controlled else aim
        forces[k] = force
        for _ in range(FINE):
            free = v + step / MASS * (force - DRAG * v)
            # Friction takes what it can of the momentum, and no more than there is.
            v = np.sign(free) * max(abs(free) - step / MASS * level, 0.0)
            x += step * v
    return positions, forces


def record_plant(drive: np.ndarray, controlled: bool, level: float = LEVEL, seed: int = 1) -> Recording:
    x, force = simulate_plant(drive, controlled, level)
    x = x + NOISE * np.random.default_rng(seed).standard_normal(len(x))
    half = len(x) * 2 // 3
    roles = (Segment(0, half, "slow", role="fit"), Segment(half, len(x), "slow", role="test"))

    def signal(samples: np.ndarray, quantity: str, unit: str) -> Signal:
        return Signal(samples[:, None], RATE_HZ, quantity, unit, ("x",))

    aimed = signal(KP * drive, "force", "N") if controlled else None
    command, seen = signal(force, "force", "N"), signal(x, "position", "m")
    return Recording("carriage", command, seen, excitation=aimed, segments=roles)


def diagnose_plant(given: Recording, *names: str):
    others = tuple(effect.name for effect in CATALOGUE if effect.name not in names)
    return diagnose([given], make_model(), DiagnosisSettings(without=others), map, lambda said, share: None)
