"""From recordings to a model file and its page; and what is said where there can be none."""

from dataclasses import replace

import numpy as np
import pytest

from equalizer.plant.model_response import compute_model_response
from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import Signal
from study.errors import StudyError, WrongUseError
from study.store.formats.identified_model_file import read_identified_model
from study.store.formats.recording_file import write_recording
from study.workflows.equalizer.identified_summary import format_summary, summarise_model
from study.workflows.equalizer.identify_model import IdentifyPlan, identify_model
from study.workflows.equalizer.report_identification import report_identification
from study.workflows.recording.import_recording import ImportPlan, import_recording
from tests.slow_instances import slow

RATE_HZ = 1000.0


def recorded(plants, commands, segments, seed=1, **meta) -> Recording:
    """Of the synthetic device, no spring of its own: the excitation is the command."""
    command = Signal(commands, RATE_HZ, "force", "N", ("fx", "fy", "fz"))
    response = Signal(
        plants.omega_like().measured(commands, seed), RATE_HZ, "acceleration", "m/s^2", ("ax", "ay", "az")
    )
    return Recording("bench", command, response, excitation=command, segments=segments, meta=meta)


def swept(plants, **meta) -> Recording:
    """One axis after the other, two periods each, then a multisine that is kept for a test."""
    period = plants.sweep(4.5, 37.0, seconds=15.0)
    parts, segments = [], []
    for axis in range(3):
        wave = np.zeros((2 * len(period), 3))
        wave[:, axis] = np.tile(period, 2)
        start = sum(len(part) for part in parts) + 1000
        segments.append(Segment(start, start + len(wave), "sweep", 1.0, len(period), "fit"))
        parts += [np.zeros((1000, 3)), wave]
    test = np.tile(plants.multisine(5.0, 35.0, seconds=5.0), (3, 1))
    start = sum(len(part) for part in parts) + 1000
    segments.append(Segment(start, start + len(test), "multisine", 1.5, 5000, "test"))
    commands = np.concatenate([*parts, np.zeros((1000, 3)), test])
    return recorded(plants, commands, tuple(segments), place_m=[0.0, 0.0, 0.0], **meta)


@pytest.fixture(scope="module")
def folder(plants, tmp_path_factory):
    folder = tmp_path_factory.mktemp("identify")
    write_recording(folder / "sweep.h5", swept(plants))
    return folder


@pytest.fixture(scope="module")
def device(folder):
    shares = []
    plan = IdentifyPlan((folder / "sweep.h5",), folder / "model.h5", order=20)
    device = identify_model(plan, shares.append)
    assert shares == sorted(shares) and shares[-1] == 1.0
    return device


@pytest.mark.slow
def test_the_model_on_disk_is_the_device(device, plants):
    model = read_identified_model(device.plan.out)
    assert (model.order, model.band_hz, model.place_m) == (20, (5.0, 35.0), (0.0, 0.0, 0.0))
    assert model.spectral_radius < 1
    assert model.delay_samples == 1.0  # read before the command of the same row is written
    f = np.linspace(5.0, 35.0, 61)
    truth = plants.omega_like().response(f)
    assert np.linalg.norm(compute_model_response(model, f) - truth) < 0.01 * np.linalg.norm(truth)


def test_a_recording_that_is_given_twice_is_refused(folder, tmp_path):
    path = folder / "sweep.h5"
    (tmp_path / "link.h5").symlink_to(path)
    import_recording(ImportPlan((path,), None, tmp_path / "copy.h5"))
    for other in (path, tmp_path / "link.h5", tmp_path / "copy.h5"):
        with pytest.raises(StudyError, match="ecording 2 holds the same samples as recording 1"):
            identify_model(IdentifyPlan((path, other), tmp_path / "model.h5", order=20), lambda share: None)
    assert not (tmp_path / "model.h5").exists()


def test_results_hold_the_hashes_of_their_input_files(device):
    provenance = read_identified_model(device.plan.out).provenance
    assert provenance["parents"][0]["file"] == "sweep.h5"
    assert (provenance["device"], provenance["input"], provenance["amplitude_n"]) == ("bench", "command", 1.0)


def test_what_is_said_is_what_was_measured(device):
    found = summarise_model(device)
    assert found["held_out_error"] == pytest.approx(found["held_out_noise"], rel=0.2)
    first, *rest = format_summary(device)
    assert f"the error of the model is {100 * found['held_out_error']:.2f} %, noise of the record" in first
    assert "friction" not in first + " ".join((*rest, *device.remarks))
    assert "Order 20, 5 to 35 Hz, stable" in " ".join(rest)


def test_the_file_keeps_how_good_the_model_is(device):
    quality = read_identified_model(device.plan.out).quality
    assert quality == device.model.quality
    assert (quality.held_out_error, quality.held_out_noise) == (device.held_out_test.error, device.held_out_test.noise)
    assert quality.expected_error >= quality.held_out_error
    assert summarise_model(device)["quality"]["expected_error"] == quality.expected_error


@pytest.mark.slow
def test_the_page_shows_transfer_functions_bands_and_the_choice_of_order(device, tmp_path):
    page = report_identification(device, tmp_path / "page", lambda share: None)
    text = page.read_text()
    for heading in ("Transfer functions", "Resonances", "Coupling begins at", "Error and cost by order"):
        assert heading in text
    assert {path.name for path in (tmp_path / "page" / "figures").iterdir()} >= {
        "transfer-functions.png", "frequency-bands.svg", "model-order.png",
    }  # fmt: skip


@pytest.mark.parametrize("outputs", [*slow(1), 2])
def test_a_page_of_a_device_whose_coupling_cannot_be_judged_says_why(plants, tmp_path, outputs):
    """Two outputs of a single force have no coupling; at 60 Hz the direction limit of 35 Hz was not measured."""
    wave = np.tile(plants.sweep(4.5, 25.0, seconds=10.0), 2)[:, None]
    rate_hz = 1000.0 if outputs == 2 else 60.0
    force = Signal(wave, rate_hz, "force", "N", ("fx",))
    accelerations = np.roll(wave, 1, axis=0) * np.arange(1, outputs + 1)
    accelerations += 1e-3 * np.random.default_rng(1).standard_normal(accelerations.shape)
    response = Signal(accelerations, rate_hz, "acceleration", "m/s^2", ("ax", "ay")[:outputs])
    segments = (Segment(0, len(wave), "sweep", 1.0, len(wave) // 2),)
    write_recording(tmp_path / "one.h5", Recording("bench", force, response, segments=segments))
    band_hz = (5.0, 20.0) if outputs == 2 else (0.4, 1.2)
    plan = IdentifyPlan((tmp_path / "one.h5",), tmp_path / "m.h5", band_hz=band_hz, order=2)
    text = report_identification(
        identify_model(plan, lambda share: None), tmp_path / "page", lambda _: None
    ).read_text()
    assert ("there are 2 outputs and 1 inputs" if outputs == 2 else "No onset of coupling was found") in text
    assert not list((tmp_path / "page" / "figures").glob("frequency-bands*"))


def refused(plan) -> StudyError:
    with pytest.raises(StudyError) as refusal:
        identify_model(plan, lambda share: None)
    assert not plan.out.exists() or plan.out.read_text() == "mine"
    return refusal.value


def test_a_band_without_energy_is_refused_with_what_would_do(folder, tmp_path):
    said = refused(IdentifyPlan((folder / "sweep.h5",), tmp_path / "m.h5", band_hz=(60.0, 120.0)))
    assert "No model can be made" in said.title
    assert "hapteq record" in said.do_now


def test_one_axis_is_too_little(plants, tmp_path):
    wave = np.zeros((20_000, 3))
    wave[:, 0] = np.tile(plants.sweep(4.5, 37.0, seconds=10.0), 2)
    write_recording(tmp_path / "x.h5", recorded(plants, wave, (Segment(0, 20_000, "sweep", 1.0, 10_000),)))
    assert "No model can be made" in refused(IdentifyPlan((tmp_path / "x.h5",), tmp_path / "m.h5")).title


@pytest.mark.slow
def test_recordings_of_two_places_are_no_model_of_one(folder, plants, tmp_path):
    other = swept(plants)
    weaker = replace(other.response, samples=0.9 * other.response.samples)
    write_recording(tmp_path / "edge.h5", replace(other, response=weaker, meta={"place_m": [0.05, 0.0, 0.0]}))
    said = refused(IdentifyPlan((folder / "sweep.h5", tmp_path / "edge.h5"), tmp_path / "m.h5", order=14))
    assert "different places; identify one model per place" in said.happened


@pytest.mark.parametrize("place_m", [*slow([0.0, 0.1], {"x": 0.0}), [0.0, 0.0, "left"], *slow([[0.0, 0.0, 0.0]])])
def test_a_place_that_is_none_is_named(plants, tmp_path, place_m):
    commands = np.tile(plants.multisine(4.5, 37.0, seconds=2.0), (2, 1))
    for number in range(3):
        segments = (Segment(0, len(commands), "multisine", 1.5, 2000),)
        recording = recorded(plants, np.roll(commands, number, axis=1), segments, place_m=place_m)
        write_recording(tmp_path / f"{number}.h5", recording)
    paths = tuple(tmp_path / f"{number}.h5" for number in range(3))
    said = refused(IdentifyPlan(paths, tmp_path / "m.h5", order=4, smooth=False))
    assert "lace_m of a recording is" in said.happened and "three numbers, x, y and z in m" in said.happened


@pytest.mark.slow
def test_the_spring_can_only_be_taken_in_where_the_excitation_is_known(folder, plants, tmp_path):
    write_recording(tmp_path / "total.h5", replace(swept(plants), excitation=None))
    said = refused(IdentifyPlan((tmp_path / "total.h5",), tmp_path / "m.h5", with_spring=True))
    assert "does not hold its excitation" in said.happened


def test_nothing_is_overwritten(folder, tmp_path):
    (tmp_path / "m.h5").write_text("mine")
    assert "never overwritten" in refused(IdentifyPlan((folder / "sweep.h5",), tmp_path / "m.h5")).happened


@pytest.mark.parametrize("changes", [{"order": 7}, {"band_hz": (35.0, 5.0)}])
def test_a_model_that_cannot_be_is_wrong_use(folder, tmp_path, changes):
    with pytest.raises(WrongUseError):
        identify_model(IdentifyPlan((folder / "sweep.h5",), tmp_path / "m.h5", **changes), lambda share: None)


def test_recordings_of_two_grips_or_under_two_springs_make_no_one_model(plants, tmp_path):
    noise = np.random.default_rng(1).standard_normal((4000, 3))
    springs = [{"hand": "none", "feedback": {"stiffness_n_per_m": k, "damping_n_s_per_m": 0.0}} for k in (50.0, 140.0)]
    for number, meta in enumerate([*springs, {"hand": "held"}]):
        write_recording(tmp_path / f"{number}.h5", recorded(plants, noise, (), **meta))
    with pytest.raises(StudyError, match=r"differ in the hand on the handle \(held; none\)"):
        identify_model(IdentifyPlan((tmp_path / "0.h5", tmp_path / "2.h5"), tmp_path / "m.h5"), lambda share: None)
    plan = IdentifyPlan((tmp_path / "0.h5", tmp_path / "1.h5"), tmp_path / "m.h5", with_spring=True)
    with pytest.raises(StudyError, match=r"differ in the spring \(140 N/m, 0 N s/m; 50 N/m"):
        identify_model(plan, lambda share: None)
    write_recording(tmp_path / "loose.h5", recorded(plants, noise, ()))
    plan = IdentifyPlan((tmp_path / "0.h5", tmp_path / "loose.h5"), tmp_path / "m.h5", with_spring=True)
    with pytest.raises(StudyError, match=r"differ in the spring \(50 N/m, 0 N s/m; none\)"):
        identify_model(plan, lambda share: None)
    write_recording(tmp_path / "text.h5", recorded(plants, noise, (), feedback={"stiffness_n_per_m": "50 N/m"}))
    plan = IdentifyPlan((tmp_path / "0.h5", tmp_path / "text.h5"), tmp_path / "m.h5", with_spring=True)
    with pytest.raises(StudyError, match=r"state '50 N/m' as stiffness_n_per_m.*Give a number"):
        identify_model(plan, lambda share: None)


@pytest.mark.parametrize("hangs_at", [0.0, pytest.param(9.81, marks=pytest.mark.slow)])
def test_an_output_that_answers_nothing_is_named(plants, tmp_path, hangs_at):
    whole = swept(plants)
    samples = np.array(whole.response.samples)
    samples[:, 2] = hangs_at
    write_recording(tmp_path / "silent.h5", replace(whole, response=replace(whole.response, samples=samples)))
    with pytest.raises(StudyError, match="There is no signal from az, not even noise"):
        identify_model(IdentifyPlan((tmp_path / "silent.h5",), tmp_path / "m.h5"), lambda share: None)
