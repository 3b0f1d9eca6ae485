"""A discovered law becomes a file of a user's own, and a later diagnosis looks for it beside the catalogue."""

import ast
from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.diagnose import diagnose
from analysis.diagnosis.diagnosis_settings import DiagnosisSettings
from equalizer.effects.discovered_law import Channels, get_law_values, make_law_effect
from equalizer.effects.effect import PlacedEffect
from equalizer.effects.law_entry import make_effects_per_axis
from equalizer.effects.simulation.simulator import simulate_mechanism
from equalizer.laws.law import parse_law
from equalizer.plant.mechanical_model import MechanicalModel, ModelEffect, Tolerance
from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import Signal
from study.errors import StudyError
from study.store.formats.mechanical_model_file import write_mechanical_model
from study.workflows.diagnosis.effect_file import read_entries, read_entry, write_entry

RATE_HZ, N = 1000.0, 20_000
LAW = parse_law("-60.0*abs(vx)**1.5*sign(vx)", "force", "x")


def body(*effects: ModelEffect) -> MechanicalModel:
    return MechanicalModel(
        name="one", quantity="acceleration", mass=[[0.3]], damping=[[2.0]], stiffness=[[300.0]], input=[[1.0]],
        output=[[1.0]], effects=effects, tolerance=Tolerance(0.01, 0.2, 10.0),
    )  # fmt: skip


@pytest.fixture
def model_file(tmp_path):
    write_mechanical_model(tmp_path / "improved.toml", body(ModelEffect("discovered_law", "x", {}, LAW)))
    return tmp_path / "improved.toml"


def test_a_law_is_written_as_an_effect_and_read_back(model_file, tmp_path):
    written = write_entry(model_file, tmp_path / "drag_of_oil.py")
    read = read_entry(tmp_path / "drag_of_oil.py")
    assert read == written
    assert (read.name, read.law.expression, read.law.numbers) == ("drag_of_oil", LAW.expression, LAW.numbers)


@pytest.mark.parametrize("axis", ['x"""\nraise SystemExit\n"""', 'x"', "x\\"])
def test_a_text_of_a_diagnosis_never_runs_as_code(tmp_path, monkeypatch, axis):
    law = replace(LAW, axis=axis)
    monkeypatch.setattr("study.workflows.diagnosis.effect_file._read_laws", lambda found: [law])
    write_entry(tmp_path / "diagnosis.json", tmp_path / "drag.py")
    assert read_entry(tmp_path / "drag.py").law.axis == axis
    assert axis in ast.get_docstring(ast.parse((tmp_path / "drag.py").read_text()), clean=False)


@pytest.mark.parametrize("name", ["Drag.py", "drag.txt", "cogging.py", "discovered_law.py"])
def test_an_invalid_effect_name_is_refused(model_file, tmp_path, name):
    with pytest.raises(StudyError, match="cannot be an effect's name"):
        write_entry(model_file, tmp_path / name)


def test_a_model_without_a_law_is_refused(tmp_path):
    write_mechanical_model(tmp_path / "plain.toml", body())
    with pytest.raises(StudyError, match="holds no discovered law"):
        write_entry(tmp_path / "plain.toml", tmp_path / "drag.py")


@pytest.mark.parametrize(
    ("text", "said"), [("x = 1\n", "defines no ENTRY"), ("1/0\n", "fails: division by zero"), (None, "is not there")]
)
def test_a_file_that_is_no_effect_is_refused(tmp_path, text, said):
    if text is not None:
        (tmp_path / "mine.py").write_text(text)
    with pytest.raises(StudyError, match=said):
        read_entry(tmp_path / "mine.py")


@pytest.mark.parametrize(
    ("changed", "into", "said"),
    [
        ("name='mine'", "name=5", "defines no ENTRY"),
        ("source='found", "source=5 or 'found", "defines no ENTRY"),
        ("axis='x'", "axis=1", "defines no ENTRY"),
        ("units=()", "units=(1, 2)", "defines no ENTRY"),
        ("numbers=(60.0, 1.5)", "numbers=('a', 1.5)", "defines no ENTRY"),
        ("numbers=(60.0, 1.5)", "numbers=(float('nan'), 1.5)", "defines no ENTRY"),
        ("ENTRY = LawEntry(", "raise SystemExit\nENTRY = LawEntry(", "fails: SystemExit"),
    ],
)
def test_a_file_that_was_changed_by_hand_is_refused_with_its_reason(model_file, tmp_path, changed, into, said):
    path = tmp_path / "mine.py"
    write_entry(model_file, path)
    assert changed in path.read_text()
    path.write_text(path.read_text().replace(changed, into))
    with pytest.raises(StudyError, match=said):
        read_entry(path)


def test_a_file_of_another_kind_is_not_said_to_be_missing(tmp_path):
    (tmp_path / "law.txt").write_text("x = 1\n")
    with pytest.raises(StudyError, match="is no Python file"):
        read_entry(tmp_path / "law.txt")


def test_at_other_axes_all_letters_turn_along(model_file, tmp_path):
    entry = write_entry(model_file, tmp_path / "drag.py")
    turned = replace(entry, law=parse_law("-2.0*vx*y + 0.1*fz + 0*t", "force", "x"))
    assert [each.law.text for each in make_effects_per_axis(turned, Channels())] == [
        "-2.0*vx*y + 0.1*fz + 0*t", "-2.0*vy*z + 0.1*fx + 0*t", "-2.0*vz*x + 0.1*fy + 0*t"
    ]  # fmt: skip
    only = replace(entry, law=parse_law("-2.0*vy**3", "force", "y"))
    assert [each.law.text for each in make_effects_per_axis(only, Channels(("u",), ("a",)))] == ["-2.0*vx**3"]


def recording(*laws) -> Recording:
    random = np.random.default_rng(3)
    lines = np.arange(4, 121, 4)
    phases = random.uniform(0, 2 * np.pi, len(lines))
    time_s = np.arange(4000) / RATE_HZ
    wave = np.cos(2 * np.pi * lines * 0.25 * time_s[:, None] + phases).sum(axis=1)
    levels = np.repeat([0.5, 1.0, 2.0, 3.0, 1.5], N // 5)
    commands = (levels * np.tile(wave / np.abs(wave).max(), N // 4000))[:, None]
    effects = [
        PlacedEffect(make_law_effect(law, Channels(("fx",), ("ax",))), (0,), get_law_values(law)) for law in laws
    ]
    answer = simulate_mechanism(body(), commands, RATE_HZ, effects).response
    noisy = answer + 0.01 * random.standard_normal(answer.shape)
    segments = tuple(Segment(k * 4000, (k + 1) * 4000, "multisine", float(levels[k * 4000]), 4000) for k in range(5))
    return Recording(
        "one", Signal(commands, RATE_HZ, "force", "N", ("fx",)),
        Signal(noisy, RATE_HZ, "acceleration", "m/s^2", ("ax",)), segments=segments,
    )  # fmt: skip


@pytest.mark.slow
def test_a_later_diagnosis_names_it_and_writes_it_into_the_model(model_file, tmp_path):
    write_entry(model_file, tmp_path / "drag_of_oil.py")
    kept = (read_entry(tmp_path / "drag_of_oil.py"),)
    other = LAW.replace_numbers([40.0, 1.6])
    found = diagnose([recording(other)], body(), DiagnosisSettings(kept=kept), map, lambda said, share: None)
    (named,) = found.diagnosis.effects
    assert (named.effect, named.axis) == ("drag_of_oil", "x")
    assert named.parameters["p0"].value == pytest.approx(40.0, rel=0.1)
    assert named.parameters["p1"].value == pytest.approx(1.6, abs=0.05)
    assert named.law is not None
    assert named.law.variables == ("vx",)
    (effect,) = found.improved.effects
    assert effect.kind == "discovered_law"
    assert effect.law is not None
    assert effect.law.numbers == pytest.approx((40.0, 1.6), rel=0.1)


def test_where_it_is_not_it_is_not_named(model_file, tmp_path):
    write_entry(model_file, tmp_path / "drag_of_oil.py")
    kept = (read_entry(tmp_path / "drag_of_oil.py"),)
    found = diagnose([recording()], body(), DiagnosisSettings(kept=kept), map, lambda said, share: None)
    assert not found.diagnosis.effects


def test_an_effect_of_a_signal_that_was_not_recorded_is_refused_before_the_search(model_file, tmp_path):
    path = tmp_path / "warm_drag.py"
    expression = write_entry(model_file, path).law.expression
    path.write_text(path.read_text().replace(repr(expression), repr(f"{expression}*warmth")))
    with pytest.raises(StudyError, match="does not fit the recordings: the law needs the signal 'warmth'") as said:
        read_entries((path,), (recording(),))
    assert "leave --effect-file out" in said.value.do_now
    assert read_entries((), (recording(),)) == ()
