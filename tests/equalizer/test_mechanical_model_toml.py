import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from equalizer.laws.law import parse_law
from equalizer.plant.effect_vocabulary import EFFECT_ENTRIES
from equalizer.plant.mechanical_model import (
    ActuatorLimits,
    MechanicalModel,
    MechanicalModelError,
    ModelEffect,
    SensorLimits,
    Tolerance,
)
from equalizer.plant.mechanical_model_toml import MATRIX_KEYS, format_mechanical_model, parse_mechanical_model
from equalizer.signals.signal import FloatArray

ONE_AXIS = """
[model]
name = "lever"
quantity = "position"
mass = [[5.755e-4]]
damping = [[1e-3]]
stiffness = [[0]]
input = [[1]]
output = [[1]]
"""

numbers = st.floats(-1e6, 1e6, allow_subnormal=False)
amounts = st.floats(0.0, 1e6, allow_subnormal=False)
words = st.text(st.characters(exclude_categories=("Cs",)), min_size=1, max_size=20)


@st.composite
def models(draw):
    n, m, p = draw(st.integers(1, 4)), draw(st.integers(1, 3)), draw(st.integers(1, 3))

    def matrix(rows: int, columns: int) -> FloatArray:
        return np.array(draw(st.lists(numbers, min_size=rows * columns, max_size=rows * columns))).reshape(
            rows, columns
        )

    kinds = draw(st.lists(st.sampled_from(EFFECT_ENTRIES), max_size=3))
    effects = tuple(
        ModelEffect(kind.name, draw(st.none() | words), {part.name: draw(numbers) for part in kind.parameters})
        for kind in kinds
    )
    root = matrix(n, n) * 1e-6
    return MechanicalModel(
        name=draw(words),
        quantity=draw(st.sampled_from(["acceleration", "position"])),
        mass=root @ root.T + np.eye(n),
        damping=matrix(n, n),
        stiffness=matrix(n, n),
        input=matrix(n, m),
        output=matrix(p, n),
        sensor=SensorLimits(draw(amounts), draw(amounts)),
        actuator=ActuatorLimits(draw(amounts), draw(amounts), draw(amounts)),
        effects=effects,
        tolerance=draw(st.none() | st.builds(Tolerance, amounts, amounts, st.none() | amounts, amounts)),
        rotational=draw(st.booleans()),
        provenance=draw(st.dictionaries(words, words | st.integers(-5, 5) | st.lists(words, max_size=2), max_size=3)),
    )


@given(models())
@settings(max_examples=60, deadline=None)
def test_a_written_model_is_read_back_to_the_last_digit(model):
    again = parse_mechanical_model(format_mechanical_model(model))
    for name in MATRIX_KEYS:
        assert np.array_equal(getattr(again, name), getattr(model, name))
    for name in ("name", "quantity", "sensor", "actuator", "effects", "tolerance", "rotational", "provenance"):
        assert getattr(again, name) == getattr(model, name)


@pytest.mark.parametrize("number", range(11))
def test_the_shared_cases_are_read_and_written_without_loss(shared, number):
    model = parse_mechanical_model((shared / "cases" / f"open-{number:02d}.toml").read_text())
    assert (model.coordinates, model.inputs, model.outputs) == (6, 3, 3)
    assert model.sensor == SensorLimits(500.0, 29.43)
    assert model.tolerance is not None
    again = parse_mechanical_model(format_mechanical_model(model))
    assert np.array_equal(again.mass, model.mass)


def test_a_small_model_needs_only_its_first_table():
    model = parse_mechanical_model(ONE_AXIS)
    assert model.mass == pytest.approx(np.array([[5.755e-4]]))
    assert (model.sensor, model.tolerance, model.effects, model.rotational) == (SensorLimits(), None, (), False)


def test_rotational_is_read_in_the_model_table_and_above_it():
    assert parse_mechanical_model(ONE_AXIS + "rotational = true\n").rotational
    assert parse_mechanical_model("rotational = true\n" + ONE_AXIS).rotational


def test_an_effect_without_axis_is_shared_by_all():
    text = (
        ONE_AXIS
        + '[[effect]]\nkind = "force_gain"\ngain = 1.1\n[[effect]]\nkind = "backlash"\naxis = "x"\ngap = 1e-4\n'
    )
    gain, backlash = parse_mechanical_model(text).effects
    assert (gain.axis, backlash.axis) == (None, "x")
    assert backlash.parameters == {"gap": 1e-4}


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("[model]", "[model", "this is not TOML:"),
        ("[model]", "[modle]", "unknown key 'modle' (did you mean 'model'?); allowed are model, sensor, actuator"),
        ("[model]", "[[model]]", "model must be a table: [model]"),
        ("damping =", "dampnig =", "unknown key 'model.dampnig' (did you mean 'damping'?); allowed are name, quantity"),
        ("damping = [[1e-3]]\n", "", "model.damping is missing"),
        ('name = "lever"\n', "", "model.name is missing; it must be a text"),
        ('"lever"', "3", "model.name is 3; it must be a text"),
        ("[[5.755e-4]]", "5.755e-4", "model.mass must be a list of rows, as in [[1, 0], [0, 1]]"),
        ("[[5.755e-4]]", "[[1, 2], [3]]", "model.mass has rows of different lengths: 2, 1"),
        ("[[5.755e-4]]", '[["heavy"]]', "model.mass holds 'heavy', which is not a number"),
        ("[[5.755e-4]]", "[[true]]", "model.mass holds True, which is not a number"),
        ("[model]", "[sensor]\nbandwith_hz = 1\n[model]", "unknown key 'sensor.bandwith_hz' (did you mean 'band"),
        ("[model]", '[sensor]\nrange = "3 g"\n[model]', "sensor.range is '3 g'; it must be a number"),
        ("[model]", "rotational = 1\n[model]", "rotational is 1; it must be true or false"),
        ("[model]", 'provenance = "measured"\n[model]', "provenance must be a table: [provenance]"),
        ("[model]", "effect = 3\n[model]", "effects are written as tables: [[effect]]"),
        ("[model]", '[[effect]]\nlevel = 1\n[model]', "effect 1 has no kind"),
        ("[model]", '[[effect]]\nkind = "backlash"\naxis = 1\ngap = 1\n[model]', "effect 1: axis is 1; it must be a"),
        ("[model]", '[[effect]]\nkind = "backlash"\ngap = "big"\n[model]', "effect 1 holds gap = 'big'; para"),
        ("[[1e-3]]", "[[inf]]", "model.damping holds values that are not finite numbers"),
    ],
)  # fmt: skip
def test_every_fault_of_the_text_is_named(old, new, problem):
    with pytest.raises(MechanicalModelError) as refused:
        parse_mechanical_model(ONE_AXIS.replace(old, new, 1))
    assert any(found.startswith(problem) for found in refused.value.problems), refused.value.problems


def test_dates_of_the_provenance_become_text():
    made = "[provenance]\nday = 2026-11-01\nat = [2026-11-01T12:00:00Z]\n[provenance.bench]\nclock = 12:30:00\n"
    origin = parse_mechanical_model(f"{ONE_AXIS}\n{made}").provenance
    assert origin == {
        "day": "2026-11-01", "at": ["2026-11-01T12:00:00+00:00"], "bench": {"clock": "12:30:00"}
    }  # fmt: skip


def test_an_empty_text_lacks_its_model():
    with pytest.raises(MechanicalModelError) as refused:
        parse_mechanical_model("")
    assert "the table [model] is missing" in refused.value.problems


def test_a_value_that_toml_does_not_have_is_refused_when_writing():
    model = parse_mechanical_model(ONE_AXIS)
    odd = MechanicalModel(
        **{name: getattr(model, name) for name in ("name", "quantity", *MATRIX_KEYS)}, provenance={"a": 1j}
    )
    with pytest.raises(TypeError, match="a value of type complex cannot be written as TOML: 1j"):
        format_mechanical_model(odd)


LAW = '[[effect]]\nkind = "discovered_law"\naxis = "x"\nacts_on = "force"\nexpression = "-2.0*vx**3"\n'


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ('"-2.0*vx**3"', '"-2.0*vx.real"', "effect 1: 'vx.real' at character 6 is not part of the language of laws"),
        ('"-2.0*vx**3"', "3", "effect 1: discovered_law lacks expression (texts)"),
        ('axis = "x"\n', "", "effect 1: discovered_law lacks axis (texts)"),
        ('"force"', '"motion"', "effect 1: a law acts on force, command, response; not on 'motion'"),
        ("acts_on", "gain = 2\nacts_on", "discovered_law has its parameters in its expression; it also gives gain"),
        ('"discovered_law"', '"discoverd_law"', "effect 1 holds acts_on = 'force', expression = '-2.0*vx**3'"),
    ],
)
def test_a_discovered_law_that_cannot_be_read_is_said_so(old, new, problem):
    assert parse_mechanical_model(ONE_AXIS + LAW).effects[0].law == parse_law("-2.0*vx**3", "force", "x")
    with pytest.raises(MechanicalModelError) as error:
        parse_mechanical_model(ONE_AXIS + LAW.replace(old, new))
    assert problem in str(error.value)
    assert len(error.value.problems) == 1
