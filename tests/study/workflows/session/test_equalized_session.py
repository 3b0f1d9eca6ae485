"""A session whose stimuli go through a model: what a level means, what is logged, what is refused."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.plant.model_quality import NOT_STORED, ModelQuality, write_quality_sentence
from equalizer.tracking.feedforward.model_equalizer import ModelEqualizer
from protocols.document.loading import load_protocol
from study.devices.clock import VirtualClock
from study.errors import StudyError
from study.session.stimulus.limits import SPRING_SLEW_N_PER_S, compute_highest_level_n, make_study_limits
from study.session.stimulus.stimulus import make_held_stimulus
from study.store.formats.identified_model_file import write_identified_model
from study.store.formats.trials_file import TRIALS_NAME, read_trials
from study.store.sessions.trial_recordings import find_trial_recording, name_recording
from study.workflows.results.analyze_data import analyze_data
from study.workflows.results.fold_session import fold_session
from study.workflows.results.session_results import write_tables
from study.workflows.session import equalize_stimuli
from study.workflows.session.conduct_session import conduct_new, conduct_resumed
from study.workflows.session.equalize_stimuli import compute_level_scales
from study.workflows.session.open_session import SessionPlan
from study.workflows.session.simulated_participant import make_simulated_participant
from study.workflows.views.session_facts import list_session_facts

MASS_KG = np.array([0.3, 0.4, 0.5])


def rigid(band_hz=(4.0, 50.0), **changes) -> IdentifiedModel:
    """A mass of its own along each axis: what a command gives is known in the head."""
    model = IdentifiedModel(
        np.zeros((3, 3)), np.diag(1 / MASS_KG), np.eye(3), np.zeros((3, 3)), 1000.0, band_hz, "N", "m/s^2",
        ("fx", "fy", "fz"), ("ax", "ay", "az"),
    )  # fmt: skip
    return replace(model, **changes)


def planned(small_text, folder) -> SessionPlan:
    write_identified_model(folder / "rigid.h5", rigid())
    text = small_text.replace("[stimulus]\n", '[stimulus]\nquantity = "delivered_acceleration"\n')
    protocol = load_protocol(text, "small.toml")
    return SessionPlan(protocol, text, False, "S1", "ideal", 7, folder / "data", model=folder / "rigid.h5")


@pytest.fixture
def plan(small_text, tmp_path):
    return planned(small_text, tmp_path)


def take(plan):
    clock = VirtualClock()
    return conduct_new(plan, "simulated", make_simulated_participant("ideal", 7, clock))


@pytest.fixture(scope="module")
def conducted(small_text, tmp_path_factory):
    return take(planned(small_text, tmp_path_factory.mktemp("equalized")))


@pytest.mark.slow
def test_both_directions_are_wanted_equally_strong_and_the_harder_one_reaches_the_cap(conducted):
    equalized = conducted.state.opened.equalized
    assert {scale.frequency_hz for scale in equalized.levels} == {5.0, 25.0, 35.0}
    for scale in equalized.levels:
        assert scale.reachable_mps2 == pytest.approx(3.0 / scale.n_per_mps2)
    # Both directions lie at 45 degrees in the yz plane; without a spring the peak is sqrt((0.4² + 0.5²) / 2) N.
    at_35_hz = next(scale for scale in equalized.levels if scale.frequency_hz == 35.0)
    assert at_35_hz.n_per_mps2 == pytest.approx(np.sqrt((0.4**2 + 0.5**2) / 2), rel=0.05)


def test_a_level_is_the_highest_force_where_the_safety_cap_lies_above_that_of_the_staircase(plan):
    staircase, demo = replace(plan.protocol.staircase, cap_n=1.0, start_n=0.5), replace(plan.protocol.demo, level_n=0.5)
    practice = replace(plan.protocol.practice, level_n=0.5)
    lower = replace(plan.protocol, staircase=staircase, demo=demo, practice=practice)
    model = ModelEqualizer(rigid())
    levels, as_before = compute_level_scales(lower, model, 1000.0), compute_level_scales(plan.protocol, model, 1000.0)
    assert [s.n_per_mps2 for s in levels] == pytest.approx([s.n_per_mps2 for s in as_before])


@pytest.mark.parametrize("rove_db", [0.0, 6.0])
def test_a_steep_stimulus_roved_to_its_highest_keeps_the_slew_limit(small_text, tmp_path, monkeypatch, rove_db):
    plan = planned(small_text, tmp_path)
    protocol = replace(
        plan.protocol,
        stimulus=replace(plan.protocol.stimulus, rove_db=rove_db),
        staircase=replace(plan.protocol.staircase, cap_n=2.1),
        demo=replace(plan.protocol.demo, level_n=1.0),
        practice=replace(plan.protocol.practice, level_n=1.0),
    )
    played = []

    def jagged(*arguments):
        """Every other sample halved: as high as before, and far steeper."""
        stimulus = make_held_stimulus(*arguments)
        forces = stimulus.onset_then_loop.copy()
        forces[1::2] /= 2
        played.append(float(np.linalg.norm(np.diff(forces, axis=0), axis=1).max()) * 1000.0)
        return SimpleNamespace(onset_then_loop=forces, loop=stimulus.loop)

    monkeypatch.setattr(equalize_stimuli, "make_held_stimulus", jagged)
    (scale, *_) = compute_level_scales(protocol, ModelEqualizer(rigid()), 1000.0)
    steepest = max(played[:2]) * compute_highest_level_n(protocol) / scale.n_per_mps2 + SPRING_SLEW_N_PER_S
    assert steepest == pytest.approx(make_study_limits(protocol).slew_n_per_s)


def test_what_is_within_reach_is_shown(conducted):
    facts = dict(list_session_facts(fold_session(conducted.folder), lambda moment: moment))
    reach = {scale.frequency_hz: scale.reachable_mps2 for scale in conducted.state.opened.equalized.levels}
    assert f"{reach[35.0]:.1f} m/s² at 35 Hz" in facts["within reach"]
    assert facts["equalizer"] == "identified model, order 3, 4 to 50 Hz"


def test_every_trial_says_which_acceleration_its_level_stands_for(conducted):
    write_tables(conducted.folder)
    n_per_mps2 = {scale.frequency_hz: scale.n_per_mps2 for scale in conducted.state.opened.equalized.levels}
    trials = read_trials(conducted.folder.path / TRIALS_NAME)
    assert len(trials) > 10
    for trial in trials:
        assert trial.wanted_mps2 == pytest.approx(trial.level_n / n_per_mps2[trial.frequency_hz])


def test_what_is_commanded_is_what_the_model_needs_with_the_spring_left_to_itself(conducted):
    """A rigid mass under the protocol's spring: total force = mass times acceleration."""
    trial = next(t for t in conducted.state.trials if t.frequency_hz == 5.0)
    _, recording = find_trial_recording(conducted.folder, name_recording(trial.run, trial.trial, trial.attempt))
    n = 200
    phasor = np.fft.rfft(recording.excitation.samples[-n:], axis=0)[1] * 2 / n
    info = conducted.state.opened.device
    assert info.simulated
    stiffness = 0.282 * (2 * np.pi * 3.5) ** 2
    needed = MASS_KG[1:] - stiffness / (2 * np.pi * 5.0) ** 2
    assert np.abs(phasor[1:]) == pytest.approx(np.abs(needed) * trial.wanted_mps2 / np.sqrt(2), rel=0.01)
    assert abs(phasor[0]) < 1e-6


def test_a_session_continues_with_the_model_it_was_begun_with(conducted):
    (conducted.folder.path.parents[1] / "rigid.h5").unlink()
    assert fold_session(conducted.folder).state == conducted.state
    with pytest.raises(StudyError, match="finished"):  # and not the model, which is in the folder
        conduct_resumed(conducted.folder, "simulated", make_simulated_participant("ideal", 7, VirtualClock()))
    (conducted.folder.path / "model.h5").write_bytes(b"another")
    with pytest.raises(StudyError, match="not the one it was begun with"):
        conduct_resumed(conducted.folder, "simulated", make_simulated_participant("ideal", 7, VirtualClock()))


def refused(plan, **changes) -> str:
    write_identified_model(plan.model, rigid(**changes), overwrite=True)
    with pytest.raises(StudyError) as refusal:
        take(plan)
    return str(refusal.value)


def test_a_model_that_does_not_cover_the_protocol_is_refused(plan):
    said = refused(plan, band_hz=(5.0, 30.0))
    assert "was made for 5 to 30 Hz; the protocol also plays 35 Hz" in said
    assert "--band 5 50" in said


@pytest.mark.slow
def test_a_spring_that_is_in_the_model_is_not_accounted_for_twice(conducted, plan):
    """Under the same spring the model is the device: no force is left to the spring; another spring is refused."""
    info = conducted.state.opened.device
    stiffness = 0.28173 * (2 * np.pi * 3.5) ** 2
    held = {"input": "excitation", "feedback": {"stiffness_n_per_m": stiffness, "damping_n_s_per_m": 0.0}}
    bare = compute_level_scales(plan.protocol, ModelEqualizer(rigid()), info.sample_rate_hz)
    assert equalized_levels(plan, held) == pytest.approx([scale.n_per_mps2 for scale in bare])
    other = {"input": "excitation", "feedback": {"stiffness_n_per_m": 50.0, "damping_n_s_per_m": 0.0}}
    assert "It holds a spring of 50 N/m" in refused(plan, provenance=other)


def equalized_levels(plan, provenance) -> list[float]:
    write_identified_model(plan.model, rigid(provenance=provenance), overwrite=True)
    return [scale.n_per_mps2 for scale in take(plan).state.opened.equalized.levels]


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"A": 1.01 * np.eye(3)}, "is not stable"),
        ({"sample_rate_hz": 2000.0}, "runs at 2000 Hz, the device at 1000 Hz"),
        ({"place_m": (0.05, 0.0, 0.0)}, "and the study is at the centre"),
        ({"output_unit": "m"}, "three accelerations in m/s^2"),
        ({"B": np.zeros((3, 3))}, "no reasonable force gives the wanted acceleration at 5, 25, 35 Hz"),
        ({"C": 1e-7 * np.eye(3)}, "no reasonable force"),
        ({"C": 1e200 * np.eye(3)}, "no reasonable force"),
        ({"C": np.diag([1.0, 1.0, 0.0])}, "no reasonable force"),
        ({"input_channels": ("fz", "fy", "fx")}, "in the order fx, fy, fz"),
    ],
)
def test_a_model_of_something_else_is_refused(plan, changes, said):
    assert said in refused(plan, **changes)
    assert not plan.data_folder.exists()


def test_a_protocol_of_commanded_forces_does_not_pretend_to_use_a_model(plan, small_protocol):
    with pytest.raises(StudyError, match="would change nothing"):
        take(replace(plan, protocol=small_protocol))


def test_a_protocol_of_accelerations_needs_a_model(plan):
    with pytest.raises(StudyError, match="no model was given"):
        take(replace(plan, model=None))


@pytest.mark.slow
def test_the_report_says_first_how_good_the_model_is(conducted, plan, tmp_path):
    data = conducted.folder.path.parent
    page = analyze_data(data, tmp_path / "out").report.read_text()
    assert page.index("How good the model of the device is") < page.index("Before you read the numbers")
    assert f"S1_001: {NOT_STORED}" in page


@pytest.mark.slow
def test_the_report_gives_the_error_that_was_measured(plan, tmp_path):
    quality = ModelQuality(0.13, 0.12, 0.001, 0.13, 0.004, 10.0)
    write_identified_model(tmp_path / "tested.h5", rigid(quality=quality))
    take(replace(plan, model=tmp_path / "tested.h5"))
    page = analyze_data(plan.data_folder, tmp_path / "out").report.read_text()
    assert f"S1_001: {write_quality_sentence(quality)}" in page
