"""Where no time is known, forces are compared along positions, and no mass, damping, second or hertz is said."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.confirm.force_balance_measures import list_fitting_measures
from analysis.diagnosis.data.measured_motion import is_quasi_static
from analysis.diagnosis.diagnose_values import diagnose_values
from analysis.diagnosis.document import Mismatch
from analysis.diagnosis.errors.choose_measure import make_measure
from analysis.diagnosis.errors.error_measure_rule import IN_SAMPLES, UNTIMED
from analysis.diagnosis.first_model.choose_structure import choose_structure
from analysis.diagnosis.result.candidate_wording import DeviceWording
from analysis.diagnosis.result.wording import describe_place
from analysis.diagnosis.search.guard import Guard
from equalizer.plant.effect_vocabulary import find_matrix_unit
from equalizer.signals.recording import Recording
from equalizer.signals.signal import Signal
from study.workflows.diagnosis.diagnosis_input import DiagnosisInput
from study.workflows.diagnosis.fit_without_model import fit_first_model

STIFFNESS, FRICTION = 500.0, 2.0


@pytest.fixture(scope="module")
def recording() -> Recording:
    """A spring with dry friction, in loops of several sizes."""
    n = np.arange(4000)
    position = 0.01 * np.sin(2 * np.pi * n / 800) * np.repeat([0.3, 0.6, 1.0, 0.8, 1.0], 800)
    force = STIFFNESS * position + FRICTION * np.sign(np.gradient(position))
    force = force + 0.02 * np.random.default_rng(1).standard_normal(len(n))
    return Recording(
        "spring", Signal(force[:, None], 1.0, "force", "N", ("fx",)),
        Signal(position[:, None], 1.0, "position", "m", ("x",)), meta={"time": "unknown"},
    )  # fmt: skip


@pytest.fixture(scope="module")
def first(recording):
    given = DiagnosisInput((recording,), ("spring",), (), ())
    return fit_first_model(given, (), (lambda: True, Guard()), lambda what, share: None)


def test_the_first_model_is_a_spring(first, recording):
    assert first.model.stiffness[0, 0] == pytest.approx(STIFFNESS, rel=0.1)  # friction bends it
    assert first.model.mass[0, 0] < 0.1 and first.model.damping[0, 0] == 0
    assert "no time is known" in first.remarks[0]


@pytest.mark.parametrize("counts_per_m", [1e6, 1e-3])
def test_mass_and_damping_are_held_alike_in_any_unit_of_the_position(first, recording, counts_per_m):
    position = replace(recording.response, samples=counts_per_m * recording.response.samples, unit="1")
    counted = choose_structure([replace(recording, response=position)], "massless", lambda share: None).fit.model
    for model in (first.model, counted):
        assert model.tolerance.mass_kg == pytest.approx(1e-6 * model.mass[0, 0])
        assert model.tolerance.damping_n_s_per_m == pytest.approx(1e-6 * model.stiffness[0, 0])
    assert counted.stiffness[0, 0] == pytest.approx(first.model.stiffness[0, 0] / counts_per_m, rel=1e-3)


def test_friction_is_weighed_and_forces_are_compared_once(first, recording):
    (balance,) = first.balances
    assert "coulomb_friction" in {law.law.effect for law in balance.named}
    (look,) = list_fitting_measures((recording,), first.model, first.balances, "auto")
    assert look.chosen.measure.name == "predicted force"
    assert look.chosen.remarks == (UNTIMED,)  # no frequency up to which they are compared


def test_a_timed_recording_of_the_same_is_played(first, recording):
    timed = Recording(recording.device, recording.command, recording.response)
    assert UNTIMED not in make_measure((timed,), first.model).remarks


def test_no_unit_holds_a_second(first):
    system = first.model.system
    assert [find_matrix_unit(part, system) for part in ("mass", "damping", "stiffness")] == [
        "N sample^2/m", "N sample/m", "N/m",
    ]  # fmt: skip
    assert (system.express("m/s"), system.express("s"), system.express("Hz")) == ("m/sample", "sample", "1/sample")


def test_no_place_is_reported_in_hertz(first):
    row = Mismatch("x", "fx", (0.0, 0.5), None, None, 0.02, 0.0)
    assert "Hz" not in describe_place(row, DeviceWording(True, first.model.system))
    assert "Hz" in describe_place(row)


@pytest.mark.slow
def test_a_speed_without_a_clock_is_diagnosed_with_samples_as_its_time():
    """A motor with dry friction, in random steps of its command."""
    random = np.random.default_rng(3)
    command = np.repeat(random.uniform(-5.0, 5.0, 75), 40)
    speed, v = np.empty(len(command)), 0.0
    for k, push in enumerate(command.tolist()):
        speed[k] = v
        for _ in range(20):
            free = v + (push - 0.2 * v) / 8.0 / 20
            v = np.sign(free) * max(abs(free) - 1.0 / 8.0 / 20, 0.0)
    speed += 0.01 * random.standard_normal(len(speed))
    motor = Recording(
        "motor", Signal(command[:, None], 1.0, "torque", "N m", ("u",)),
        Signal(speed[:, None], 1.0, "angular velocity", "rad/s", ("w",)), meta={"time": "unknown"},
    )  # fmt: skip
    found = diagnose_values([motor])
    assert [effect.effect for effect in found.diagnosis.effects] == ["coulomb_friction"]
    assert found.improved.mass[0, 0] == pytest.approx(8.0, rel=0.05)
    assert find_matrix_unit("mass", found.improved.system) == "N m sample^2/rad"
    assert IN_SAMPLES in found.remarks and UNTIMED not in found.remarks
    assert found.diagnosis.fit.test.after < 0.02


@pytest.mark.parametrize(
    ("quantities", "time", "still"),
    [
        (("position",), "unknown", True), (("position", "velocity"), "unknown", True), (("force",), "unknown", True),
        (("velocity",), "unknown", False), (("velocity", "acceleration"), "unknown", False), (("position",), "", False),
    ],
)  # fmt: skip
def test_only_positions_without_a_clock_stand_still_in_time(quantities, time, still):
    names = tuple("xyz"[: len(quantities)])
    response = Signal(np.zeros((9, len(names))), 1.0, quantities, "1", names)
    push = Signal(np.zeros((9, 1)), 1.0, "force", "N", ("fx",))
    assert is_quasi_static(Recording("r", push, response, meta={"time": time})) == still
