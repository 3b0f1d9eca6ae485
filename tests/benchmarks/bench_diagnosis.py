"""A diagnosis of 105 s on three axes against the simulations it needs, done by scipy.signal.lsim; and how it grows.

Counted are the hypotheses and open numbers that a diagnosis tries out; each costs at least one simulation of the whole
recording. Fits, intervals and all that is drawn from them come on top, in our time alone.
"""

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.signal import StateSpace, lsim

import equalizer.effects.simulation.simulator as simulator
from analysis.diagnosis.diagnose import diagnose
from analysis.diagnosis.diagnosis_settings import DiagnosisSettings
from equalizer.effects.catalogue import CATALOGUE
from study.evaluation.challenge.draw_case import Case, draw_case
from study.workflows.forked_map import map_forked, measure_processor_s

SEED = 61
EFFECTS = ((), ("sensor_lag",), ("force_saturation",), ("coulomb_friction",))
PLAIN_SAMPLES = 10_000
"""Of lsim, whose time grows with them."""
NEEDED = 1.0
"""Times that lsim alone takes longer than the whole diagnosis, at the median."""
AIMED_S = 60.0
"""Aim, and no bar: others may use the processor."""
LINEAR = 1.3
"""Times that twice as much may take more than twice as long."""


@dataclass
class Counted:
    """A map that counts what it is given."""

    map_: Callable
    items: int = 0

    def __call__(self, function, *items):
        whole = [list(item) for item in items]
        self.items += len(whole[0])
        return self.map_(function, *whole)


@dataclass(frozen=True)
class Taken:
    wall_s: float
    cpu_s: float
    tried: int
    said: str


def diagnosed(case: Case, without: tuple[str, ...] = (), times: int = 1) -> Taken:
    """times: of the recording, one after another."""
    counted = Counted(map_forked)
    wall, cpu = time.perf_counter(), measure_processor_s()
    settings = DiagnosisSettings(without=without)
    found = diagnose([case.recording] * times, case.model, settings, counted, lambda what, share: None)
    taken = time.perf_counter() - wall, measure_processor_s() - cpu
    said = found.diagnosis
    return Taken(*taken, counted.items, f"{said.verdict} {' '.join(effect.effect for effect in said.effects)}")


def lsim_s(case: Case) -> float:
    """CPU seconds of one simulation of the whole recording by the linear model."""
    model, n = case.model, case.model.coordinates
    by_motion = -np.linalg.solve(model.mass, np.hstack([model.stiffness, model.damping]))
    by_command = np.linalg.solve(model.mass, model.input)
    system = StateSpace(
        np.vstack([np.hstack([np.zeros((n, n)), np.eye(n)]), by_motion]),
        np.vstack([np.zeros_like(by_command), by_command]),
        model.output @ by_motion,
        model.output @ by_command,
    )
    rate_hz, commands = case.recording.sample_rate_hz, case.recording.command.samples
    short = commands[:PLAIN_SAMPLES]
    taken = []
    for _ in range(3):
        began = time.process_time()
        lsim(system, short, np.arange(len(short)) / rate_hz, interp=False)
        taken.append(time.process_time() - began)
    return min(taken) * len(commands) / len(short)


def report(line: str) -> None:
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def grows(what: str, once: Taken, again: Taken, factor: float) -> bool:
    """factor: how much more there was to do."""
    growth = again.cpu_s / once.cpu_s
    report(
        f"{what}: {factor:.2f} times as much takes {growth:.2f} times as long (at most {LINEAR * factor:.2f} wanted)"
    )
    return growth <= LINEAR * factor


def concealed(number: int) -> Case:
    return draw_case(SEED + number, EFFECTS[number], strength=0.6 if EFFECTS[number] else None)


def main() -> int:
    simulator.KEPT_BYTES = 0  # a recording that is given twice is simulated twice
    diagnosed(draw_case(SEED, ["coulomb_friction"]), tuple(each.name for each in CATALOGUE[3:]))
    ratios, walls, last = [], [], None
    for number, effects in enumerate(EFFECTS):
        case = concealed(number)
        last, plain = diagnosed(case), lsim_s(case)
        ratios.append(last.tried * plain / last.cpu_s)
        walls.append(last.wall_s)
        report(
            f"{' '.join(effects) or 'nothing':18} {last.wall_s:6.1f} s, {last.cpu_s:6.1f} CPU s, {last.said}; "
            f"{last.tried} tried, for which lsim takes {last.tried * plain:.0f} CPU s: {ratios[-1]:.1f} times as long"
        )
    report(f"lsim / ours, median: {np.median(ratios):.1f} (needed {NEEDED:g})")
    report(f"wall time, median: {np.median(walls):.1f} s (aim {AIMED_S:g} s)")
    good = float(np.median(ratios)) >= NEEDED
    good &= grows("samples", last, diagnosed(case, times=2), 2.0)
    half = tuple(each.name for each in CATALOGUE[::2] if each.name not in effects)
    fewer = diagnosed(case, half)
    return int(not (grows("hypotheses", fewer, last, last.tried / fewer.tried) and good))


if __name__ == "__main__":
    sys.exit(main())
