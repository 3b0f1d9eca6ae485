"""A device with physics of its own, clean and with a fault: what came since is named, and only that."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from analysis.diagnosis import diagnose as engine
from analysis.diagnosis.contrast.actuator_faults import actuator_faults
from analysis.diagnosis.contrast.compare import compared
from analysis.diagnosis.contrast.decide import Decided, decide
from analysis.diagnosis.contrast.lines import hum_of, noise_of, steps_of
from analysis.diagnosis.contrast.stream import FOLDS
from analysis.diagnosis.contrast.taken import taken_of
from analysis.diagnosis.diagnose import DiagnosisSettings, diagnose
from analysis.diagnosis.forces.rigid_model import rigid_model
from analysis.diagnosis.reference import learn_model_error as learn_clean_floor
from analysis.diagnosis.reference.compare_with_reference import Contrast, contrast_of
from analysis.diagnosis.reference.learn_model_error import NothingLearned
from analysis.diagnosis.result.contrast_findings import NOT_COMPARED, _named, with_contrast
from analysis.diagnosis.search.time_budget import OUT_OF_TIME
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray, Signal
from equalizer.signals.unit_system import LINEAR

RATE_HZ, COUNT = 500.0, 5000
UNDONE = (
    "coulomb_friction", "asymmetric_friction", "presliding_hysteresis", "viscous_damping", "quadratic_damping",
    "force_gain", "force_gain_drift", "actuator_cubic", "force_deadband", "force_saturation",
)  # fmt: skip
"""All that comes near dry friction."""


def motion(seed: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Position, velocity, acceleration: a sum of sines up to 6 Hz."""
    random, t = np.random.default_rng(seed), np.arange(COUNT) / RATE_HZ
    found = np.zeros((3, COUNT))
    for f in np.arange(0.25, 6.0, 0.25):
        turn, phase, size = 2 * np.pi * f, random.uniform(0, 2 * np.pi), 0.02 / (1 + f**2)
        found[0] += size * np.sin(turn * t + phase)
        found[1] += size * turn * np.cos(turn * t + phase)
        found[2] -= size * turn**2 * np.sin(turn * t + phase)
    return found[0], found[1], found[2]


def recording(seed: int, change: str = "", level: float = 0.0) -> Recording:
    """Friction that is stronger at rest and on one side, a bent spring, model error that changes slowly."""
    q, v, a = motion(seed)
    random = np.random.default_rng(seed + 100)
    own = 1.2 * a + 3.0 * v + 80.0 * q + 9000.0 * q**3 + (1.0 + 0.6 * np.exp(-((v / 0.02) ** 2))) * np.tanh(v / 0.004)
    slow = np.convolve(random.normal(size=COUNT + 400), np.hanning(400), "same")[:COUNT]
    force = own + 0.03 * np.std(own) * slow / slow.std() + 0.005 * np.std(own) * random.normal(size=COUNT)
    position = q + 2e-6 * random.normal(size=COUNT)
    added = {"added_mass": a, "viscous_damping": v, "coulomb_friction": np.tanh(v / 0.004)}
    if change in added:
        force = force + level * added[change]
    if change == "force_gain":
        force = force / level
    if change == "sensor_gain":
        position = position * level
    if change == "mains_hum":
        position = position + level * np.sin(2 * np.pi * 50.02 * np.arange(COUNT) / RATE_HZ)
    return Recording(
        "rig",
        Signal(force[:, None], RATE_HZ, "force", "N", ("fx",)),
        Signal(position[:, None], RATE_HZ, "position", "m", ("x",)),
        meta={"imposed": ""},
    )


def time_left() -> bool:
    return True


def decided(faulty: Recording, without: frozenset[str] = frozenset()) -> Decided:
    found = compared([faulty], [recording(1)], without, time_left)
    assert found is not None
    return decide(found, 1)


@pytest.mark.parametrize(
    ("change", "level", "number", "place"),
    [
        ("added_mass", 0.3, "mass", "mechanism"),
        ("viscous_damping", 2.0, "damping", "mechanism"),
        ("coulomb_friction", 0.6, "level", "mechanism"),
        ("force_gain", 0.75, "gain", "actuator"),
        ("sensor_gain", 1.3, "gain", "sensor"),
    ],
)
def test_what_came_since_is_named_with_its_place_and_number(change, level, number, place):
    found = decided(recording(2, change, level))
    assert found.named is not None
    assert (found.named.fault.effect, found.named.fault.place) == (change, place)
    assert found.named.values[number] == pytest.approx(level, rel=0.15)


def two_drives(seed: int, gain: float = 1.0) -> Recording:
    """Two drives push one body; the second gives `gain` of what it is commanded."""
    random, count, dt = np.random.default_rng(seed), 3000, 1 / RATE_HZ / 4
    drives = lfilter([0.05], [1.0, -0.95], random.standard_normal((count, 2)), axis=0)
    position, q, v = np.zeros(count), 0.0, 0.0
    for k, push in enumerate(drives @ [1.0, 0.7 * gain]):
        position[k] = q
        for _ in range(4):
            v += dt * (push - 2 * v - 100 * q) / 0.3
            q += dt * v
    position += 1e-4 * position.std() * random.standard_normal(count)
    return Recording(
        "rig",
        Signal(drives, RATE_HZ, "force", "N", ("fx", "fy")),
        Signal(position[:, None], RATE_HZ, "position", "m", ("x",)),
    )


@pytest.mark.parametrize("gain", [0.6, 1.4])
def test_the_gain_of_one_of_two_drives_of_one_body_is_told_the_right_way_round(gain):
    faulty = two_drives(3, gain)
    found = compared([faulty], [two_drives(4)], frozenset(), time_left)
    assert found is not None and not found.by_force
    answer = decide(found, 1)
    assert answer.named is not None
    named = _named(answer.named, answer, faulty, LINEAR)
    assert (named.effect, named.axis) == ("force_gain", "y")
    assert named.parameters["gain"].value == pytest.approx(gain, rel=0.05)


def test_two_drives_of_one_body_in_order_name_nothing():
    found = compared([two_drives(5)], [two_drives(4)], frozenset(), time_left)
    assert found is not None
    assert decide(found, 1).named is None


def test_the_error_is_that_of_the_faulty_recording_however_many_clean_ones_there_are():
    """Scaled by its own error, what is left of a set is at least as much as a description of its own leaves."""
    only = frozenset(UNDONE) - {"viscous_damping"}
    for clean in ([recording(1)], [recording(seed) for seed in (1, 3, 4, 5)]):
        found = compared([recording(2, "viscous_damping", 2.0)], clean, only, time_left)
        assert found is not None
        assert found.faulty_samples == pytest.approx(found.samples / (1 + len(clean)), rel=0.01)
        assert 1.0 <= found.plain[:FOLDS].sum() / found.faulty_samples < 2.0


def test_a_law_that_holds_the_named_one_takes_nothing_from_its_probability():
    found = decided(recording(2, "coulomb_friction", 0.6))
    assert found.named is not None and found.named.fault.effect == "coulomb_friction"
    assert "asymmetric_friction" not in found.alike
    assert found.probability > 0.9


def test_a_fault_that_may_sit_on_either_of_two_axes_is_not_named():
    found = compared([recording(2, "added_mass", 0.3)], [recording(1)], frozenset(), time_left)
    assert found is not None
    best = decide(found, 1).named
    assert best is not None
    twin = replace(best, fault=replace(best.fault, axis="fy", site=1))
    answer = decide(replace(found, weighed=(best, twin)), 1)
    assert answer.named is None
    assert "fy" in answer.others[0][1]


@pytest.mark.parametrize("seed", [2, 3])
def test_another_recording_of_the_same_device_names_nothing(seed):
    assert decided(recording(seed)).named is None


def test_an_effect_that_is_not_to_be_considered_is_not_named():
    found = decided(recording(2, "added_mass", 0.3), frozenset({"added_mass"}))
    assert found.named is None or found.named.fault.effect != "added_mass"


def test_a_body_alone_cannot_tell_a_mass_from_a_gain():
    """The force is proportional to the acceleration: more mass, less force, and a sensor that reads less are one."""
    random = np.random.default_rng(5)

    def body(seed: int, mass: float) -> Recording:
        _, _, a = motion(seed)
        plain = recording(seed)
        force = mass * a + 0.02 * a.std() * random.normal(size=COUNT)
        return replace(plain, command=replace(plain.command, samples=force[:, None]))

    found = compared([body(2, 1.6)], [body(1, 1.2)], frozenset(), time_left)
    assert found is not None
    answer = decide(found, 1)
    names = {one.fault.effect for one, _ in answer.others} if answer.named is None else set(answer.alike)
    assert {"force_gain", "sensor_gain"} <= names | {"" if answer.named is None else answer.named.fault.effect}


def read_as(seed: int, made) -> Recording:
    """The device in order, its position read otherwise. made: of readings (n,)."""
    whole = recording(seed)
    return replace(whole, response=replace(whole.response, samples=made(whole.response.samples[:, 0])[:, None]))


def behind(gap: float):
    """A reading that is driven through a gap."""

    def made(y: FloatArray) -> FloatArray:
        found, read = np.empty_like(y), y[0]
        for k, here in enumerate(y):
            read = min(max(read, here - gap / 2), here + gap / 2)
            found[k] = read
        return found

    return made


def test_play_before_a_sensor_is_named_with_its_gap():
    found = decided(read_as(2, behind(0.008)))
    assert found.named is not None and found.named.fault.effect == "sensor_play"
    assert found.named.values["gap"] == pytest.approx(0.008, rel=0.2)


def test_a_drift_that_began_before_the_recording_is_no_offset():
    found = decided(read_as(2, lambda y: y + 0.04 * np.linspace(0.4, 1.0, len(y))))
    assert found.named is not None and found.named.fault.effect == "sensor_drift"


def test_an_offset_is_no_drift():
    found = decided(read_as(2, lambda y: y + 0.03))
    best = found.named or found.others[0][0]
    assert best.fault.effect == "sensor_offset" and "sensor_drift" not in found.alike


def in_turns(seed: int, late: FloatArray) -> Recording:
    """Two masses on springs, read late: by how many samples, per sixth of the recording."""
    random = np.random.default_rng(seed)
    push = lfilter([0.1], [1.0, -0.9], random.standard_normal((3000, 2)), axis=0)
    moved = np.column_stack([lfilter([0.0, 0.02], [1.0, -1.9, 0.92 + 0.01 * k], push[:, k]) for k in range(2)])
    moved += 0.002 * moved.std() * random.standard_normal(moved.shape)
    at = np.arange(3000.0) - np.repeat(late, 500)
    read = np.column_stack([np.interp(at, np.arange(3000.0), each) for each in moved.T])
    return Recording(
        "rig",
        Signal(push, RATE_HZ, "force", "N", ("fx", "fy")),
        Signal(read, RATE_HZ, "displacement", "m", ("x", "y")),
    )


def test_a_logger_that_reads_all_channels_late_is_named_once():
    found = compared([in_turns(2, np.full(6, 2.0))], [in_turns(1, np.zeros(6))], frozenset(), time_left)
    assert found is not None
    answer = decide(found, 2)
    assert answer.named is not None
    assert (answer.named.fault.effect, answer.named.fault.axis) == ("logger_offset", "")
    assert answer.named.values["offset"] == pytest.approx(2 / RATE_HZ, rel=0.25)


def test_a_logger_that_is_late_now_and_then_in_both_sets_is_not_named():
    faulty, clean = in_turns(2, np.array([0, 2, 1, 2, 0, 2.0])), in_turns(1, np.array([0, 0, 2, 0, 1, 0.0]))
    found = compared([faulty], [clean], frozenset(), time_left)
    assert found is not None
    assert decide(found, 2).named is None


def test_recordings_of_rest_and_of_motion_are_not_compared():
    """What a device does at rest is foretold by no recording of its motion."""
    resting = read_as(2, lambda y: 0.01 * y)
    assert compared([resting], [recording(1)], frozenset(), time_left) is None
    assert compared([recording(1)], [resting], frozenset(), time_left) is None


def test_a_line_of_the_mains_is_seen_where_the_clean_recording_has_none():
    clean = taken_of([recording(1)])
    found = hum_of(taken_of([recording(2, "mains_hum", 2e-5)]), clean)
    assert found is not None
    assert found.values == {"frequency": pytest.approx(50.0, abs=0.1), "amplitude": pytest.approx(2e-5, rel=0.2)}
    assert hum_of(taken_of([recording(2)]), clean) is None


def noisy(rms: float, seed: int = 2) -> Recording:
    plain = recording(seed)
    more = rms * np.random.default_rng(9).normal(size=plain.response.samples.shape)
    return replace(plain, response=replace(plain.response, samples=plain.response.samples + more))


def test_white_noise_is_seen_where_the_clean_recording_has_less():
    clean = taken_of([recording(1)])
    found = noise_of(taken_of([noisy(2e-5)]), clean)
    assert found is not None
    assert found.values == {"rms": pytest.approx(2e-5, rel=0.1)}
    assert noise_of(taken_of([recording(2)]), clean) is None


def test_what_is_only_louder_at_times_or_at_some_frequencies_is_no_noise_of_the_sensor():
    clean, plain = taken_of([recording(1)]), noisy(2e-5)
    half = np.where(np.arange(COUNT)[:, None] < COUNT // 2, recording(2).response.samples, plain.response.samples)
    assert noise_of(taken_of([replace(plain, response=replace(plain.response, samples=half))]), clean) is None
    steep = recording(2).response.samples + 2e-5 * np.diff(
        np.random.default_rng(9).normal(size=(COUNT + 6, 1)), 6, axis=0
    )
    assert noise_of(taken_of([replace(plain, response=replace(plain.response, samples=steep))]), clean) is None


def test_a_command_in_steps_is_seen_where_the_clean_one_has_none():
    clean, plain = taken_of([recording(1)]), recording(2)
    stepped = replace(plain, command=replace(plain.command, samples=0.1 * np.round(plain.command.samples / 0.1)))
    found = steps_of(taken_of([stepped]), clean)
    assert found is not None
    assert (found.place, found.values) == ("actuator", {"step": pytest.approx(0.1)})
    assert steps_of(taken_of([plain]), clean) is None
    assert steps_of(taken_of([stepped]), taken_of([stepped])) is None


def test_a_drive_that_follows_slowly_is_named():
    plain = recording(2)
    force, limit = plain.command.samples[:, 0].copy(), 40.0 / RATE_HZ
    asked = np.repeat(force[::250], 250)
    given = np.empty(COUNT)
    reached = asked[0]
    for k, wanted in enumerate(asked):
        reached += np.clip(wanted - reached, -limit, limit)
        given[k] = reached
    part = taken_of([replace(plain, command=replace(plain.command, samples=asked[:, None]))])
    (fault,) = [each for each in actuator_faults(0, "fx", part, True) if each.effect == "slew_limit"]
    left = [np.std(variant.undo[0](part[0]).command[:, 0] - given) for variant in fault.variants]
    best = fault.variants[int(np.argmin(left))]
    assert best.values(np.ones(1))["rate"] == pytest.approx(40.0, rel=0.5)
    assert min(left) < 0.3 * np.std(asked - given)


def test_what_is_cut_short_ends_with_what_it_has():
    found = compared([recording(2, "added_mass", 0.3)], [recording(1)], frozenset(), lambda: False)
    assert found is not None and not found.complete
    assert decide(found, 1).named is None


def contrast(change: str = "", level: float = 0.0, without: tuple[str, ...] = (), seed: int = 2) -> Contrast:
    return contrast_of([recording(seed, change, level)], [recording(1)], frozenset(without), time_left)


def test_a_fault_that_the_comparison_cannot_undo_is_left_open():
    found = contrast("coulomb_friction", 0.6, UNDONE)
    assert found.left_open
    assert not set(UNDONE) & set(found.weighed)
    assert "added_mass" in found.weighed


def test_nothing_is_left_open_where_a_fault_is_named():
    found = contrast("coulomb_friction", 0.6)
    assert not found.left_open
    assert found.compared is not None and found.compared.complete


@pytest.mark.parametrize("seed", [2, 3])
def test_nothing_is_left_open_between_recordings_of_the_same_device(seed):
    assert not contrast(seed=seed).left_open


def test_clean_recordings_that_teach_a_model_nothing_leave_the_comparison_as_it_is(monkeypatch):
    asked = []

    def teaches_nothing(*given):
        asked.append(given)
        raise NothingLearned("they were measured otherwise")

    for asks in (engine, learn_clean_floor):
        monkeypatch.setattr(asks, "learned_from", teaches_nothing)
    clean = recording(1)
    settings = DiagnosisSettings(without=UNDONE, clean=(clean,))
    faulty = recording(2, "coulomb_friction", 0.6)
    found = diagnose([faulty], rigid_model([clean], "given"), settings, map, lambda said, share: None)
    assert len(asked) == 2
    assert found.diagnosis.verdict == "unexplained"
    assert found.diagnosis.candidates
    assert not found.diagnosis.effects
    assert not {NOT_COMPARED, OUT_OF_TIME} & set(found.remarks)
    assert NOT_COMPARED in with_contrast(found, Contrast(None, None, None, None), faulty, 5.0).remarks
    part = contrast_of([faulty], [clean], frozenset(), lambda: False)
    assert OUT_OF_TIME in with_contrast(found, part, faulty, 5.0).remarks
