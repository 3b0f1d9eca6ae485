import numpy as np
import pytest

from equalizer.tracking.bands.low_band import compute_low_band_forces, plan_motion, plan_motion_causally
from equalizer.tracking.bands.rigid_model import RigidModel, fit_rigid_model
from equalizer.tracking.feedforward.virtual_spring import VirtualSpring

RATE_HZ = 1000.0
PLANS = [plan_motion, plan_motion_causally]


@pytest.fixture(scope="module")
def slow(plants):
    wanted = plants.multisine(1.0, 3.5, seconds=8, rms=0.3) * np.hanning(8000)[:, None]
    return np.pad(wanted, ((2000, 2000), (0, 0)))


@pytest.mark.parametrize("plan", PLANS)
def test_position_velocity_and_acceleration_are_one_motion(plan, slow):
    motion = plan(slow, RATE_HZ)
    velocity = np.gradient(motion.position_m, 1 / RATE_HZ, axis=0)
    acceleration = np.gradient(motion.velocity_mps, 1 / RATE_HZ, axis=0)
    assert np.abs(velocity - motion.velocity_mps).max() < 2e-4 * np.abs(velocity).max()
    assert np.abs(acceleration - motion.acceleration_mps2).max() < 2e-4 * np.abs(acceleration).max()
    assert motion.travel_m == pytest.approx(np.linalg.norm(motion.position_m, axis=1).max())


@pytest.mark.parametrize("plan", PLANS)
@pytest.mark.parametrize("frequency_hz", [1.0, 3.0])
def test_the_corner_takes_the_stated_share(plan, frequency_hz):
    t = np.arange(20000) / RATE_HZ
    motion = plan(np.sin(2 * np.pi * frequency_hz * t)[:, None], RATE_HZ, 0.5)
    middle = motion.acceleration_mps2[5000:15000, 0]
    played = 2 * np.exp(-2j * np.pi * frequency_hz * t[5000:15000]) @ middle / 10000 * 1j
    share = frequency_hz**2 / (frequency_hz**2 + 0.25)
    lead = 0.0 if plan is plan_motion else 2 * np.arctan(0.5 / frequency_hz)
    assert abs(played) == pytest.approx(share, rel=1e-3)
    assert np.angle(played) == pytest.approx(lead, abs=1e-3)


def test_the_synthetic_device_plays_the_planned_acceleration(plants, slow):
    device, lines = plants.omega_like(), np.arange(0.5, 4.05, 0.1)
    rigid = fit_rigid_model(lines, device.response(lines), RATE_HZ)
    motion = plan_motion(slow, RATE_HZ, 0.1)
    played = device.play(compute_low_band_forces(motion, rigid, RATE_HZ))
    assert np.linalg.norm(played - motion.acceleration_mps2) < 0.01 * np.linalg.norm(slow)
    assert np.linalg.norm(played - slow) < 0.01 * np.linalg.norm(slow)


def test_superposed_on_a_rendered_spring_a_free_mass_makes_the_planned_motion(slow):
    mass_kg, spring = 0.3, VirtualSpring(120.0, 2.0)
    rigid = RigidModel(mass_kg * np.eye(3), np.zeros((3, 3)), np.zeros((3, 3)))
    motion = plan_motion(slow, RATE_HZ)
    rendered = -(spring.stiffness_n_per_m * motion.position_m + spring.damping_n_s_per_m * motion.velocity_mps)
    added = compute_low_band_forces(motion, rigid, RATE_HZ) - rendered
    position, velocity, made = np.zeros(3), np.zeros(3), np.empty_like(slow)
    for k, force in enumerate(added):
        made[k] = position
        entering = force - spring.stiffness_n_per_m * position - spring.damping_n_s_per_m * velocity
        acceleration = entering / mass_kg
        position = position + velocity / RATE_HZ + acceleration / (2 * RATE_HZ**2)
        velocity = velocity + acceleration / RATE_HZ
    assert np.linalg.norm(made - motion.position_m) < 0.01 * np.linalg.norm(motion.position_m)


def test_a_corner_must_be_a_frequency():
    with pytest.raises(ValueError, match="corner_hz is 0.0; it must be above zero and below half the sample rate"):
        plan_motion(np.zeros((10, 3)), RATE_HZ, 0.0)
