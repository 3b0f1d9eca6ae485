"""A diagnosis made from real fits: a small simulated device with dry friction that its model lacks. Compiles."""

from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.document import (
    Diagnosis,
    Errors,
    Estimate,
    Fit,
    Mismatch,
    NamedEffect,
    NextExperiment,
    Rival,
)
from analysis.diagnosis.error_measure import FreeSimulation
from analysis.diagnosis.explain import Explanation
from analysis.diagnosis.findings import BlackBox, Course, Findings
from analysis.diagnosis.gather_evidence import gather_evidence
from analysis.diagnosis.hypothesis import NOTHING, Claim, claimed
from analysis.diagnosis.mismatch_cells import Prediction, mismatch_cells
from analysis.diagnosis.noise_floor import noise_floor
from analysis.diagnosis.observed import noise_in_units, observed
from analysis.diagnosis.output_error import evaluated
from analysis.diagnosis.rivalry import Arena, refine
from analysis.diagnosis.signature_curves import Names, signature_of
from analysis.diagnosis.tuning import tuning_of
from equalizer.effects.amplifier_lag import EFFECT as LAG
from equalizer.effects.coulomb_friction import EFFECT as DRY
from equalizer.effects.effect import PlacedEffect
from equalizer.effects.simulator import simulate_mechanism
from equalizer.plant.mechanical_model import MechanicalModel, SensorLimits, Tolerance
from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import Signal

RATE_HZ = 1000.0
PERIOD, LOOKS = 1000, 3
LEVELS_N = (0.5, 1.5, 3.0)
FRICTION_N = 0.2
NOISE = (0.05, 4e-6)
"""Rms of acceleration and position."""
STAGES = ("before", "retuned", "after")


@dataclass(frozen=True)
class Made:
    findings: Findings
    recording: Recording


def device(axes: int) -> MechanicalModel:
    eye = np.eye(axes)
    couple = 0.01 * (np.ones((axes, axes)) - eye)
    return MechanicalModel(
        "small", "acceleration", 0.25 * eye + couple, 4.0 * eye, 130.0 * eye, eye, eye, SensorLimits(400.0, 0.0),
        tolerance=Tolerance(0.003, 0.3, 8.0, 0.01),
    )  # fmt: skip


RUBBING = (PlacedEffect(DRY, (0,), {"level": FRICTION_N}),)


def recorded(axes: int, effects=RUBBING, seed: int = 3) -> Recording:
    """Each axis at three levels, then a test at the middle one; friction at the first axis unless told otherwise."""
    rng = np.random.default_rng(seed)
    commands, segments, at = [], [], 0
    plan = [(axis, level, "fit") for axis in range(axes) for level in LEVELS_N]
    plan += [(axis, LEVELS_N[1], "test") for axis in range(axes)]
    for axis, level, role in plan:
        wave = np.zeros((LOOKS * PERIOD + 200, axes))
        wave[: LOOKS * PERIOD, axis] = np.tile(_multisine(rng, level), LOOKS)
        commands.append(wave)
        segments.append(Segment(at, at + LOOKS * PERIOD, "multisine", level, PERIOD, role))
        at += len(wave)
    command = np.vstack(commands)
    played = simulate_mechanism(device(axes), command, RATE_HZ, effects)
    names = "xyz"[:axes]

    def signal(samples, quantity, unit, letter="", noise=0.0):
        read = samples + noise * rng.standard_normal(samples.shape)
        return Signal(read, RATE_HZ, quantity, unit, tuple(letter + name for name in names))

    return Recording(
        "small", signal(command, "force", "N", "f"),
        signal(played.response, "acceleration", "m/s^2", "a", NOISE[0]),
        signal(played.position, "position", "m", "", NOISE[1]), segments=tuple(segments),
    )  # fmt: skip


def _multisine(rng, level):
    lines = np.arange(1, 120, 2)
    lines = lines[np.arange(len(lines)) % 4 != 2]
    t = np.arange(PERIOD) / RATE_HZ
    wave = np.sum(np.cos(2 * np.pi * np.outer(lines, t) + rng.uniform(0, 2 * np.pi, (len(lines), 1))), axis=0)
    return level * wave / np.abs(wave).max()


def diagnosed(axes: int, recording: Recording, given: MechanicalModel) -> Findings:
    """given: the model that lacks the friction."""
    seen = observed(recording, given.outputs)
    floor = noise_floor(recording)
    noise = np.r_[floor.response_rms, floor.position_rms]
    measure = FreeSimulation((seen,), noise_in_units(seen.measured, noise), noise)
    tuning = tuning_of(given, recording.command.channels)
    found = _explained(Arena(measure, tuning, map), axes)
    residuals = {name: getattr(found, name).fitted.residuals[0] * measure.unit for name in STAGES}
    courses = {name: seen.measured - one for name, one in residuals.items()}
    channels = (*recording.response.channels, *recording.position.channels)
    after = found.after.fitted
    named = after.hypothesis.placed()
    without = evaluated(measure, tuning, after.deviations, NOTHING)
    evidence = gather_evidence(measure, tuning, without)
    names = Names(tuple("xyz"[:axes]), recording.response.channels, "m/s^2")
    p = given.outputs
    maps = {name: mismatch_cells(recording, Prediction(one[:, :p], one[:, p:]), floor) for name, one in courses.items()}
    document = _document(found, noise, seen, maps)
    standings = {name: getattr(found, name).standing.test for name in STAGES}
    return Findings(
        diagnosis=document, explanation=found, given=given, improved=tuning.tuned(after.deviations), named=named,
        evidence=evidence,
        courses=(
            Course("record", RATE_HZ, channels, ("m/s^2",) * p + ("m",) * p, seen.measured, *courses.values(),
                   tuple((one.start, one.stop) for one in recording.segments if one.role == "test")),
        ),
        noise_rms=dict(zip(channels, noise, strict=True)),
        channel_errors={name: dict(zip(channels, one, strict=True)) for name, one in standings.items()},
        mismatch=document.mismatch,
        signatures=tuple(signature_of(evidence[0], one, (), names, recording.hold) for one in named),
        black_box=BlackBox("ARX", 12, 0.05, 0.02), remarks=("A remark.",), maps=maps, floor=floor, tuning=tuning,
        axes=tuple("xyz"[:axes]),
        split_s={part: float(getattr(seen, part).sum()) / RATE_HZ for part in ("fit", "choose", "test")},
    )  # fmt: skip


def _explained(arena, axes) -> Explanation:
    """Friction at each axis and a lag, all fitted; the best is held to be true."""
    measure, tuning = arena.measure, arena.tuning
    before = evaluated(measure, tuning, np.zeros(len(tuning.names)), NOTHING)
    retuned = refine(arena, before)
    claims = [(DRY, "one", (site,), {"level": 0.1}) for site in range(axes)]
    claims.append((LAG, "all", tuple(range(axes)), {"time_constant": 1e-3}))
    starts = [claimed(Claim(*claim), [values]) for *claim, values in claims]
    fits = [refine(arena, refine(arena, evaluated(measure, tuning, retuned.deviations, one))) for one in starts]
    round_ = sorted((arena.contender(one) for one in fits), key=lambda one: one.standing.chosen_by)
    return Explanation(arena.contender(before), arena.contender(retuned), round_[0], (tuple(round_),), (round_[0],))


def _document(found, noise, seen, maps) -> Diagnosis:
    signal = np.sqrt(np.mean(seen.measured**2, axis=0))

    def errors(part):
        stands = [getattr(getattr(found, name).standing, part) for name in STAGES]
        return Errors(*(float(np.sqrt(np.mean((one * noise / signal) ** 2))) for one in (*stands, np.ones(len(noise)))))

    def listed(cells):
        return tuple(
            Mismatch(one.output, one.input, one.band_hz, one.amplitude, None, min(one.share, 1.0), one.adjusted_p_value)
            for one in cells
            if one.significant
        )

    effects = tuple(
        NamedEffect(
            one.effect.name, "mechanism", "xyz"[one.sites[0]], 0.9, 0.97,
            {"level": Estimate(one.values["level"], "N", (0.97 * one.values["level"], 1.03 * one.values["level"]))},
            (Rival("amplifier_lag", 0.03, False, "it leaves 4.1 times the noise"),),
        )
        for one in found.after.fitted.hypothesis.placed()
    )  # fmt: skip
    return Diagnosis(
        "explained" if effects else "no_mismatch", listed(maps["before"]), effects, {}, (),
        Fit(errors("fit"), errors("test")), "free simulation",
        NextExperiment("hapteq record slow.toml", ("coulomb_friction", "stribeck_friction"), "slow motion"),
    )  # fmt: skip
