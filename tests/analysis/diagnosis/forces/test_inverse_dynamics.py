from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.data import motion_smoother
from analysis.diagnosis.data.motion_smoother import smooth_motion
from analysis.diagnosis.data.observed_parts import observe_parts
from analysis.diagnosis.errors.choose_measure import make_force_measure
from analysis.diagnosis.forces.inverse_dynamics import compute_band_motion, compute_required_force
from equalizer.effects.catalogue import EFFECTS
from equalizer.effects.effect import PlacedEffect
from equalizer.effects.simulation.dry_friction_kernel import compute_bristle_deflection
from equalizer.effects.simulation.forces_along_motion import compute_effect_forces_along_motion
from equalizer.effects.simulation.simulator import simulate_mechanism
from equalizer.plant.linear_simulation import DiscreteModel, discretise_model
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.band_limited import filter_low_pass
from equalizer.signals.recording import Recording
from equalizer.signals.signal import Signal

RATE_HZ = 1000.0
TIME_S = np.arange(4000) / RATE_HZ


def make_body(mass: float = 2.0, damping: float = 5.0, stiffness: float = 300.0, quantity: str = "position"):
    return MechanicalModel("make_body", quantity, [[mass]], [[damping]], [[stiffness]], [[1.0]], [[1.0]])


def _raise_singular(*_of: object) -> None:
    raise np.linalg.LinAlgError("singular")


def test_a_sine_needs_the_force_of_the_books() -> None:
    omega = 2 * np.pi * 2.0
    x = 0.03 * np.sin(omega * TIME_S)
    needed = compute_required_force(make_body(), compute_band_motion(x[:, None], RATE_HZ, 50.0))
    wanted = (300.0 - 2.0 * omega**2) * x + 5.0 * 0.03 * omega * np.cos(omega * TIME_S)
    inside = slice(200, -200)
    assert np.allclose(needed.force[inside, 0], wanted[inside], atol=2e-3 * np.abs(wanted).max())
    assert np.allclose(needed.axis_velocity[inside, 0], 0.03 * omega * np.cos(omega * TIME_S)[inside], atol=1e-3)


def test_a_steady_slide_needs_its_damping_and_spring() -> None:
    x = 0.1 + 0.2 * TIME_S
    needed = compute_required_force(make_body(), compute_band_motion(x[:, None], RATE_HZ, 50.0))
    assert np.allclose(needed.force[:, 0], 300.0 * x + 5.0 * 0.2, atol=1e-6)
    assert np.allclose(needed.axis_velocity, 0.2, atol=1e-6)


def test_bodies_that_are_not_measured_are_moved_along() -> None:
    two = MechanicalModel(
        "two", "position", np.diag([2.0, 0.5]), np.diag([5.0, 8.0]), [[900.0, -600.0], [-600.0, 600.0]],
        [[1.0], [0.0]], [[1.0, 0.0]],
    )  # fmt: skip
    force = filter_low_pass(np.random.default_rng(1).standard_normal((4000, 1)), RATE_HZ, 10.0)
    force *= np.clip(np.minimum(TIME_S, TIME_S[::-1]) / 0.5, 0, 1)[:, None]
    moved = simulate_mechanism(two, force, RATE_HZ).response
    needed = compute_required_force(two, compute_band_motion(moved, RATE_HZ, 60.0)).force
    entered = filter_low_pass(force, RATE_HZ, 60.0, delay_s=0.5 / RATE_HZ)
    assert np.std((needed - entered)[300:-600]) < 0.01 * np.std(entered)


def test_a_band_limited_signal_keeps_its_place_and_comes_late_when_asked() -> None:
    slow, fast = np.sin(2 * np.pi * 3 * TIME_S), np.sin(2 * np.pi * 200 * TIME_S)
    inside = slice(300, -300)
    assert np.allclose(filter_low_pass((slow + fast)[:, None], RATE_HZ, 30.0)[inside, 0], slow[inside], atol=2e-3)
    late = filter_low_pass(slow[:, None], RATE_HZ, 30.0, delay_s=0.01)
    assert np.allclose(late[inside, 0], np.sin(2 * np.pi * 3 * (TIME_S - 0.01))[inside], atol=2e-3)


def test_friction_along_a_motion_is_that_of_the_simulation() -> None:
    rubbing = (PlacedEffect(EFFECTS["coulomb_friction"], (0,), {"level": 1.5}),)
    force = 12.0 * np.sin(2 * np.pi * 1.3 * TIME_S)[:, None]
    played = simulate_mechanism(make_body(), force, RATE_HZ, rubbing)
    velocity = played.axis_velocity
    motion = played.axis_position, velocity, np.gradient(velocity, 1 / RATE_HZ, axis=0)
    along = compute_effect_forces_along_motion(make_body(), rubbing, motion, (force, played.axis_force), RATE_HZ)
    sliding = np.abs(velocity[:, 0]) > 0.02
    assert np.allclose(along[sliding], played.axis_force[sliding], atol=1e-3)


def test_what_sticks_answers_to_what_pushes_against_it() -> None:
    rubbing = (PlacedEffect(EFFECTS["coulomb_friction"], (0,), {"level": 1.5}),)
    still = np.zeros((400, 1))
    pushing = np.linspace(0.0, 3.0, 400)[:, None]
    along = compute_effect_forces_along_motion(make_body(), rubbing, (still, still, still), (pushing, pushing), RATE_HZ)
    settled = slice(50, None)
    assert np.allclose(along[settled], -np.minimum(pushing, 1.5)[settled], atol=0.05)


@pytest.mark.parametrize(
    ("name", "values"),
    [("coulomb_friction", {"level": 20.0}), ("presliding_hysteresis", {"level": 20.0, "stiffness": 2e3})],
)
def test_without_a_mass_friction_follows_the_motion_and_not_what_is_missing(name, values) -> None:
    """What is missing is less than the level everywhere, and not in the least that friction's force."""
    omega = 2 * np.pi * 1.3
    x, v = (0.03 * course[:, None] for course in (np.sin(omega * TIME_S), omega * np.cos(omega * TIME_S)))
    missing = 5.0 * np.sin(2 * np.pi * 0.9 * TIME_S)[:, None]
    light = make_body(mass=1e-6, damping=0.0)
    commands = 300.0 * x + missing

    along = compute_effect_forces_along_motion(
        light, (PlacedEffect(EFFECTS[name], (0,), values),), (x, v, -(omega**2) * x), (commands, missing), RATE_HZ
    )

    bent = np.sign(v[:, 0]) if name == "coulomb_friction" else compute_bristle_deflection(x[:, 0], 0.01)
    inside = np.abs(v[:, 0]) > 0.05 * v.max()
    assert np.std((along[:, 0] + 20.0 * bent)[inside]) < 0.5


@pytest.mark.parametrize("by_doubling", [True, False])
@pytest.mark.parametrize("quantity", ["position", "velocity", "acceleration"])
def test_the_smoother_finds_motion_and_missing_force_of_a_drifting_plant(
    monkeypatch: pytest.MonkeyPatch, quantity: str, by_doubling: bool
) -> None:
    """by_doubling: where that breaks down, an ordered Schur form finds the same."""
    if not by_doubling:
        monkeypatch.setattr(motion_smoother, "_solve_riccati_by_doubling", _raise_singular)
    plant = make_body(stiffness=0.0 if quantity != "acceleration" else 300.0, quantity=quantity)
    rng = np.random.default_rng(4)
    force = 3.0 * np.sin(2 * np.pi * 1.1 * TIME_S)[:, None]
    missing = 0.5 * np.sin(2 * np.pi * 2.3 * TIME_S + 1.0)[:, None]
    played = simulate_mechanism(plant, force + missing, RATE_HZ)
    noise = 1e-4 * played.response.std()
    seen = Signal(played.response + noise * rng.standard_normal(played.response.shape), RATE_HZ, quantity, "1", ("x",))
    recording = Recording("make_body", Signal(force, RATE_HZ, "force", "N", ("x",)), seen)
    found = smooth_motion(plant, observe_parts([recording], 1)[0], force, np.array([noise]))
    inside = slice(500, -100)
    assert np.std((found.missing_force - missing)[inside]) < 0.2 * np.std(missing)
    assert np.std((found.axis_velocity - played.axis_velocity)[inside]) < 0.02 * np.std(played.axis_velocity)


def test_a_smoother_of_what_is_not_finite_says_that_there_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(motion_smoother, "discretise_model", _steps_of_nan)
    recording = Recording(
        "make_body", *(Signal(np.ones((50, 1)), RATE_HZ, what, "1", ("x",)) for what in ("force", "position"))
    )
    with pytest.raises(np.linalg.LinAlgError):
        smooth_motion(make_body(), observe_parts([recording], 1)[0], np.ones((50, 1)), np.array([1.0]))


def _steps_of_nan(model: MechanicalModel, step_s: float) -> DiscreteModel:
    steps = discretise_model(model, step_s)
    return replace(steps, transition=np.full_like(steps.transition, np.nan))


def test_the_noise_of_an_idle_axis_is_not_capped_by_its_own_force() -> None:
    """Force needed along an axis that nothing drives is all noise; of no axis more than the largest force is."""
    both = MechanicalModel("two", "position", 2 * np.eye(2), 5 * np.eye(2), 300 * np.eye(2), np.eye(2), np.eye(2))
    noise = 1e-4 * np.random.default_rng(6).standard_normal((4000, 2))
    command = np.stack([3 * np.sin(2 * np.pi * 1.1 * TIME_S), np.zeros(4000)], axis=1)
    moved = simulate_mechanism(both, command, RATE_HZ).response + noise
    signals = (Signal(each, RATE_HZ, what, "1", ("x", "y")) for each, what in ((command, "force"), (moved, "position")))
    measure = make_force_measure([Recording("two", *signals)], both, None).measure
    (left,) = measure.residuals(both, ())
    inside = slice(500, -500)
    assert np.std(left[inside, 1]) < 3
    assert measure.noise.max() <= np.std(command, axis=0).max()


def test_the_noise_is_capped_by_the_force_that_is_compared_and_not_by_that_at_the_ends() -> None:
    """With a model that is far too heavy all is noise, and a shock at the start, which no error counts, is none of it;
    with a larger cap, any model would agree with the device."""
    rng = np.random.default_rng(7)
    command = 3 * np.sin(2 * np.pi * 1.1 * TIME_S)[:, None]
    moved = simulate_mechanism(make_body(), command, RATE_HZ).response + 1e-4 * rng.standard_normal((4000, 1))
    shocked = command + np.where(np.arange(4000) < 20, 2000.0, 0.0)[:, None]
    signals = (Signal(shocked, RATE_HZ, "force", "N", ("x",)), Signal(moved, RATE_HZ, "position", "m", ("x",)))
    measure = make_force_measure([Recording("heavy", *signals)], make_body(mass=1e9), 5.0).measure
    (record,) = measure.records
    compared = record.fit | record.choose | record.test
    assert np.std(record.measured) > 3 * np.std(record.measured[compared])
    assert measure.noise[0] == pytest.approx(np.std(record.measured[compared]), rel=0.01)


TWO_BODIES = MechanicalModel("two", "position", 2 * np.eye(2), 5 * np.eye(2), 300 * np.eye(2), np.eye(2), np.eye(2))


def record_driven_axis(axis: int, noise_m: float) -> Recording:
    """Of two uncoupled bodies, the one that is driven; the other reads exactly 0."""
    command, read = np.zeros((4000, 2)), np.zeros((4000, 2))
    command[:, axis] = 3 * np.sin(2 * np.pi * 1.1 * TIME_S)
    moved = simulate_mechanism(TWO_BODIES, command, RATE_HZ).response[:, axis]
    read[:, axis] = moved + noise_m * np.random.default_rng(axis).standard_normal(4000)
    signals = (Signal(each, RATE_HZ, what, "1", ("x", "y")) for each, what in ((command, "force"), (read, "position")))
    return Recording("two", *signals)


def test_an_axis_at_rest_says_nothing_of_the_noise_of_its_force() -> None:
    records = [record_driven_axis(axis, 3e-4) for axis in (0, 1)]
    alone = [make_force_measure([record], TWO_BODIES, 10.0).measure.noise[axis] for axis, record in enumerate(records)]
    in_turn = make_force_measure(records, TWO_BODIES, 10.0).measure
    assert in_turn.noise == pytest.approx(np.array(alone) / np.sqrt(2), rel=0.02)


def test_a_recording_at_rest_does_not_widen_the_band() -> None:
    moving = record_driven_axis(0, 3e-4)
    held = replace(moving, response=replace(moving.response, samples=np.zeros((4000, 2))))
    alone, both = (make_force_measure(each, TWO_BODIES, None).measure for each in ([moving], [moving, held]))
    assert both.band_hz == alone.band_hz
