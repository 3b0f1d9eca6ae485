"""Whole diagnoses, from a recording and a model to a name, against devices that share no code with them.

Short recordings here; `make prove-diagnosis` asks for the labelled cases, too; `make prove-bank` draws long ones.
"""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from analysis.diagnosis.diagnose import diagnose
from analysis.diagnosis.diagnosis_settings import DiagnosisSettings
from equalizer.effects.catalogue import CATALOGUE
from equalizer.signals.recording import Recording
from study.store.formats.mechanical_model_file import read_mechanical_model
from study.store.formats.recording_file import read_recording
from study.workflows.forked_map import map_forked

SEED = 11
FRICTION = {"coulomb_friction": {"level": 0.1}}
SATURATION = {"force_saturation": {"limit": 2.1}}
AMONG = ("coulomb_friction", "viscous_damping", "hardening_stiffness", "force_gain", "constant_force")
"""Where not the whole catalogue is asked, for the time that it takes."""
SLOW = (
    "stribeck_friction",
    "presliding_hysteresis",
    "position_dependent_friction",
    "loose_joint",
    "backlash",
    "end_stop",
)
"""Fitted at length where something rubs; the bank asks for them, too."""


@pytest.fixture(scope="module")
def short(module_at):
    return module_at(Path(__file__).with_name("short_cases.py")).short_case


def found_in(case, without=()):
    return diagnose([case.recording], case.model, DiagnosisSettings(without=tuple(without)), map, quiet).diagnosis


def quiet(what, share):
    pass


def all_but(*names):
    return tuple(effect.name for effect in CATALOGUE if effect.name not in names)


@pytest.mark.parametrize(
    ("concealed", "main"),
    [
        (FRICTION, "level"),
        pytest.param({"hardening_stiffness": {"k3": 4e5}}, "k3", marks=pytest.mark.slow),
        pytest.param({"sensor_lag": {"bandwidth": 85.0}}, "bandwidth", marks=pytest.mark.slow),
        pytest.param(SATURATION, "limit", marks=pytest.mark.slow),
    ],
    ids=lambda given: next(iter(given)) if isinstance(given, dict) else "",
)
def test_what_is_missing_is_named_with_its_number(short, concealed, main):
    ((name, values),) = concealed.items()
    found = found_in(short(SEED, concealed), without=SLOW if name == "coulomb_friction" else ())
    assert found.verdict == "explained"
    assert [(effect.effect, effect.axis) for effect in found.effects] == [(name, "x")]
    assert found.effects[0].parameters[main].value == pytest.approx(values[main], rel=0.01)
    assert found.fit.test.after < 1.25 * found.fit.test.noise < 0.5 * found.fit.test.retuned


def test_where_nothing_is_missing_no_physics_is_named(short):
    found = found_in(short(SEED, {}))
    assert found.verdict == "parameters"
    assert found.effects == ()
    assert found.fit.test.retuned < 1.05 * found.fit.test.noise < found.fit.test.before


def test_an_effect_without_strength_is_not_named(short):
    assert found_in(short(SEED, {"coulomb_friction": {"level": 1e-5}})).effects == ()


@pytest.mark.slow
def test_what_no_catalogue_holds_is_never_explained(short):
    found = found_in(short(SEED, {"force_hysteresis": {"half_width": 0.15}}))
    assert found.verdict in ("unexplained", "partly_explained")
    assert found.fit.test.retuned > 3 * found.fit.test.noise


@pytest.mark.slow
def test_without_the_true_effect_no_other_one_explains(short):
    found = found_in(short(SEED, SATURATION), without=["force_saturation"])
    assert found.verdict in ("unexplained", "partly_explained")
    assert all(effect.effect != "force_saturation" for effect in found.effects)


@pytest.mark.slow
def test_commands_in_another_order_explain_nothing(short):
    case = short(SEED, FRICTION)
    shuffled = np.random.default_rng(1).permutation(case.recording.command.samples)
    lost = with_command(case.recording, shuffled)
    found = diagnose([lost], case.model, DiagnosisSettings(without=all_but(*AMONG)), map, quiet).diagnosis
    assert found.verdict == "unexplained"
    assert found.effects == ()


def with_command(recording: Recording, samples: np.ndarray) -> Recording:
    return replace(recording, command=replace(recording.command, samples=samples))


@pytest.mark.slow
def test_the_axis_that_rubs_is_named(short):
    found = found_in(short(SEED, FRICTION, axis=2, axes=(0, 2)), without=all_but(*AMONG))
    assert [(effect.effect, effect.axis) for effect in found.effects] == [("coulomb_friction", "z")]


@pytest.mark.slow
@pytest.mark.timeout(0)
@pytest.mark.parametrize("number", range(11))
def test_labelled_cases_are_named_right(shared, number):
    folder = shared / "cases"
    truth = json.loads((folder / f"open-{number:02d}.truth.json").read_text(encoding="utf-8"))
    recording = read_recording(folder / f"open-{number:02d}.h5")
    model = read_mechanical_model(folder / f"open-{number:02d}.toml")
    found = diagnose([recording], model, DiagnosisSettings(), map_forked, quiet).diagnosis
    named = {(effect.effect, effect.axis) for effect in found.effects}
    assert {name for name, _ in named} == {each["effect"] for each in truth}
    assert {(name, axis) for name, axis in named if axis} <= {(each["effect"], each["axis"]) for each in truth}
    assert found.verdict == ("explained" if truth else "parameters")
