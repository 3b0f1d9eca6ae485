"""The published figures from small protocols: whole, gone on with, and refused."""

import json
from dataclasses import replace

import pytest

from analysis.evaluation.reproduction.document import ReproductionError, reproduction_from_json
from study.errors import StudyError, UserInterruptError
from study.evaluation.reproduction.reproduce_paper import identify_or_load, reproduce_paper
from study.evaluation.reproduction.reproduce_recordings import RecordingRequest, record_or_load
from study.evaluation.reproduction.reproduction_plan import ReproducedProtocols, ReproductionPlan, StepProgress
from study.store.disk.file_errors import UnusableFileError
from study.store.formats.identified_model_file import read_identified_model
from study.store.formats.recording_file import read_recording, write_recording
from study.store.formats.reproduction_file import read_reproduction
from study.workflows.files.validate import validate_file

SAFETY = """
[spring]
natural_frequency_hz = 3.5
damping_n_s_per_m = 0.0
[safety]
stimulus_cap_n = 3.0
total_cap_n = 4.5
"""


def sweeps(name: str, low: float, high: float, seconds: float, hand: str = "none", amplitude: float = 2.0) -> str:
    head = f'name = "{name}"\nkind = "recording"\ntitle = "Short sweeps"\nhand = "{hand}"\n'
    segments = [
        f'[[segments]]\nkind = "sweep"\nrole = "fit"\nalong = "{axis}"\nfrom_hz = {low}\nto_hz = {high}\n'
        f"duration_s = {seconds}\nperiods = 3\namplitude_n = {amplitude}\n"
        for axis in "xyz"
    ]
    return head + "".join(segments) + SAFETY


@pytest.fixture(scope="module")
def plan(tmp_path_factory, small_text) -> ReproductionPlan:
    folder = tmp_path_factory.mktemp("paper")
    texts = {
        "study": small_text,
        "sweep": sweeps("sweep", 2.0, 400.0, 6.0),
        "band": sweeps("band", 4.5, 37.0, 6.0),
        "hand": sweeps("hand", 4.5, 37.0, 6.0, hand="held", amplitude=1.0),
    }
    for name, text in texts.items():
        (folder / f"{name}.toml").write_text(text)
    paths = {name: str(folder / f"{name}.toml") for name in texts}
    protocols = ReproducedProtocols(**paths)
    return ReproductionPlan(folder / "out", 2, 3, 1, protocols, order=8, period_s=2.0)


@pytest.fixture(scope="module")
def written(plan):
    shares: list[float] = []
    found = reproduce_paper(plan, shares.append)
    assert shares == sorted(shares)
    assert shares[-1] == pytest.approx(1.0)
    return found


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_all_five_figures_come_out_beside_what_is_published(written, plan):
    assert [figure.figure for figure in written.reproduction.figures] == [1, 2, 3, 4, 5]
    assert len(written.lines) == 5
    page = written.report.read_text()
    assert all(f"Figure {number}:" in page for number in range(1, 6))
    assert "Everything here was simulated" in page
    drawn = {path.name for path in plan.figures.iterdir()}
    assert {"equalized-response.png", "transfer-functions.svg", "ellipsoids.png", "frequency-bands.svg"} <= drawn


@pytest.mark.slow
def test_the_quality_of_the_models_comes_before_what_they_play(written, plan):
    models = {model.name: model for model in written.reproduction.models}
    assert set(models) == {"centre", "between 1", "between 2", "frictionless", "hand"}
    stored = read_identified_model(plan.models / "centre.h5").quality
    assert models["centre"].expected_error == stored.expected_error >= (stored.held_out_error or 0.0)
    page = written.report.read_text()
    assert page.index("Quality of the identified models") < page.index("What came out")
    assert f"<td>{100 * stored.expected_error:.2f} %</td>" in page


@pytest.mark.slow
def test_the_document_is_read_again_and_recognised(written):
    assert read_reproduction(written.document) == written.reproduction
    assert validate_file(written.document).problems == ()


@pytest.mark.slow
def test_a_document_with_a_wrong_number_says_where(written, tmp_path):
    document = json.loads(written.document.read_text())
    document["order"] = "eight"
    wrong = tmp_path / "wrong.json"
    wrong.write_text(json.dumps(document))
    with pytest.raises(UnusableFileError, match="order: "):
        read_reproduction(wrong)
    with pytest.raises(ReproductionError, match="device: "):
        reproduction_from_json({"order": 8})


@pytest.mark.slow
def test_the_equalizer_is_better_at_the_centre_than_nothing(written):
    rows = {(row.name, row.device, row.signal): row for row in written.reproduction.played}
    device = written.reproduction.device
    plain = rows["Not equalized, centre", device, "sweep"]
    equalized = rows["Equalized, centre", device, "sweep"]
    assert equalized.error < plain.error / 2
    assert equalized.flatness_db < plain.flatness_db


@pytest.mark.slow
def test_friction_is_named_and_its_twin_stands_beside_it(written):
    devices = {row.device for row in written.reproduction.played}
    assert devices == {"simulated omega.3", "simulated omega.3 without friction"}
    assert "Effect of friction on the delivered acceleration" in written.report.read_text()


@pytest.mark.slow
def test_the_next_run_takes_what_is_there(written, plan):
    files = [folder / "centre.h5" for folder in (plan.recordings, plan.models)]
    kept = [path.stat().st_mtime_ns for path in files]
    found = record_or_load(plan, RecordingRequest("centre", plan.protocols.band), lambda share: None)
    assert identify_or_load(plan, found, lambda share: None).model.order == 8
    assert [path.stat().st_mtime_ns for path in files] == kept


@pytest.mark.slow
def test_a_part_of_a_recording_is_made_again(written, plan):
    path = plan.recordings / "ellipsoid.h5"
    whole = read_recording(path)
    path.unlink()
    write_recording(path, replace(whole, meta={**whole.meta, "interrupted": True}))
    found = record_or_load(plan, RecordingRequest("ellipsoid", "ellipsoid"), lambda share: None)
    assert not found.recording.meta["interrupted"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("wanted", "why"),
    [
        (RecordingRequest("ellipsoid", "sweep"), "it follows another protocol"),
        (RecordingRequest("ellipsoid", "ellipsoid", (0.0, 0.0, 0.01)), "it was made at another place"),
    ],
)
def test_another_recording_of_that_name_is_refused(written, plan, wanted, why):
    with pytest.raises(StudyError, match=f"holds another reproduction.*{why}"):
        record_or_load(plan, wanted, lambda share: None)


def test_a_recording_of_the_device_of_another_version_is_refused(plan, tmp_path):
    other, request = replace(plan, output_folder=tmp_path), RecordingRequest("centre", plan.protocols.hand)
    other.recordings.mkdir()
    made = record_or_load(other, request, lambda share: None)
    provenance = made.recording.meta["provenance"]
    older = {**provenance, "versions": {**provenance["versions"], "hapteq": "0.0.1"}}
    made.path.unlink()
    write_recording(made.path, replace(made.recording, meta={**made.recording.meta, "provenance": older}))
    with pytest.raises(StudyError, match="holds another reproduction.*made with another version of hapteq"):
        record_or_load(other, request, lambda share: None)


def test_a_recording_that_cannot_be_read_is_left_alone(plan, tmp_path):
    other = replace(plan, output_folder=tmp_path)
    other.recordings.mkdir()
    (other.recordings / "centre.h5").write_text("no recording")
    with pytest.raises(StudyError, match="it cannot be read"):
        record_or_load(other, RecordingRequest("centre", plan.protocols.band), lambda share: None)
    assert (other.recordings / "centre.h5").read_text() == "no recording"


@pytest.mark.slow
def test_another_seed_in_the_same_folder_is_refused(written, plan):
    other = ReproductionPlan(plan.output_folder, 2, 4, 2, plan.protocols, order=8, period_s=2.0)
    with pytest.raises(StudyError, match="holds another reproduction.*made with another seed"):
        reproduce_paper(other, lambda share: None)


def test_interrupted_it_says_that_the_same_command_continues(plan, tmp_path):
    stopped = ReproductionPlan(tmp_path, 2, 3, 2, plan.protocols, order=8, period_s=2.0)

    def stop(share: float) -> None:
        raise KeyboardInterrupt

    with pytest.raises(UserInterruptError, match="Run the same command again"):
        reproduce_paper(stopped, stop)


def test_progress_never_steps_back():
    told: list[float] = []
    steps = StepProgress({"a": 1.0, "b": 3.0}, told.append)
    steps.make_callback("a")(1.0)
    steps.make_callback("b")(0.5)
    steps.make_callback("b")(0.2)
    steps.make_callback("b")(2.0)
    assert told == [0.25, 0.625, 0.625, 1.0]
