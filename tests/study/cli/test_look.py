"""`hapteq look`, and `hapteq show` on recordings."""

import json
from dataclasses import replace

import h5py
import numpy as np
import pytest

from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import Signal
from study.cli.main import main
from study.store.formats.recording_file import write_recording

pytestmark = pytest.mark.usefixtures("validated_here")

RATE_HZ = 500.0


@pytest.fixture(scope="module")
def lever():
    """A force, a clipped acceleration in answer to it, and a setting."""
    rng = np.random.default_rng(1)
    force = np.convolve(rng.standard_normal(6000), np.hanning(9), "same")

    def signal(samples, quantity, unit, name):
        return Signal(samples[:, None], RATE_HZ, quantity, unit, (name,))

    return Recording(
        "a lever",
        signal(force, "force", "N", "fx"),
        signal(np.clip(3 * force, -8, 8), "acceleration", "m/s^2", "ax"),
        segments=(Segment(0, 3000, "noise", 5.0, role="fit"), Segment(3000, 6000, "noise", 5.0, role="test")),
        meta={"grip": "light", "import": {"notes": ["ax: 3 samples are missing."]}},
        condition=signal(np.full(6000, 293.0), "temperature", "K", "motor"),
    )


@pytest.fixture(scope="module")
def written(lever, tmp_path_factory):
    path = tmp_path_factory.mktemp("look") / "lever.h5"
    write_recording(path, lever)
    return path


def test_a_look_says_channels_segments_and_what_is_wrong(written, capsys):
    assert main(["look", str(written)]) == 0
    said = capsys.readouterr().out
    assert said.startswith("lever: 12 s at 500 Hz, 3 channels, 2 segments; checks: 1 wrong, ")
    assert "\nwrong   clipping: response 'ax' is cut off at 8 m/s^2 and −8 m/s^2: " in said
    assert any("⣿" in line for line in said.splitlines())
    assert any(line.split()[:4] == ["condition", "motor", "temperature", "K"] for line in said.splitlines())
    assert "\n1 noise  fit " in said
    assert "further checks (--all shows them)" in said
    assert "Every command and every sensor changes." not in said


def test_all_checks_are_shown_when_asked_for(written, capsys):
    assert main(["look", str(written), "--all"]) == 0
    assert "fine    constant channels: Every command and every sensor changes." in capsys.readouterr().out


def test_a_program_reads_one_entry_per_recording(written, capsys):
    assert main(["look", str(written), str(written), "--json"]) == 0
    first, second = json.loads(capsys.readouterr().out)
    assert first == second
    assert (first["recording"], first["sample_rate_hz"], first["samples"]) == ("lever", RATE_HZ, 6000)
    assert [check["name"] for check in first["checks"] if check["level"] == "wrong"] == ["clipping"]
    assert first["coherence"][0]["share"] > 0.8


@pytest.mark.slow
def test_a_page_with_figures_is_written(written, tmp_path, capsys):
    assert main(["look", str(written), "--out", str(tmp_path / "page")]) == 0
    assert f"Report: {tmp_path / 'page' / 'report.html'}" in capsys.readouterr().err
    page = (tmp_path / "page" / "report.html").read_text()
    assert "is cut off at 8 m/s^2" in page
    assert page.count("<svg") == 3
    drawn = {path.name for path in (tmp_path / "page" / "figures").iterdir()}
    assert drawn == {f"{name}-1.{kind}" for name in ("signals", "spectra", "coherence") for kind in ("svg", "png")}


@pytest.mark.slow
def test_missing_samples_and_short_recordings_are_drawn_too(lever, tmp_path):
    few = replace(
        lever,
        **{name: getattr(lever, name).select_samples(0, 5) for name in ("command", "response", "condition")},
        segments=(),
    )
    holes = lever.response.samples.copy()
    holes[100:2000] = np.nan
    write_recording(tmp_path / "few.h5", few)
    write_recording(tmp_path / "holes.h5", replace(lever, response=replace(lever.response, samples=holes)))
    nothing = np.full_like(holes, np.nan)
    write_recording(tmp_path / "none.h5", replace(lever, response=replace(lever.response, samples=nothing)))
    paths = [str(tmp_path / f"{name}.h5") for name in ("few", "holes", "none")]
    assert main(["look", *paths, "--out", str(tmp_path / "page")]) == 0


def test_what_is_no_recording_is_an_error_by_name(tmp_path, capsys):
    (tmp_path / "a.h5").write_text("nothing")
    assert main(["look", str(tmp_path / "a.h5")]) == 1
    assert "a.h5" in capsys.readouterr().err


def test_show_on_a_recording_says_what_it_says_of_itself(written, capsys):
    assert main(["show", str(written)]) == 0
    said = capsys.readouterr().out
    assert said.startswith('lever: a lever, 12 s at 500 Hz, 6000 samples\nhold: zero-order\ngrip: "light"\n')
    assert "import: ax: 3 samples are missing." in said
    assert f"Its checks: hapteq look {written}" in said
    assert "clipping" not in said


def test_what_was_assumed_of_a_file_of_others_is_said(tmp_path, capsys):
    """Its import is in memory only: what `hapteq import` notes was said by no look."""
    with h5py.File(tmp_path / "others.h5", "w") as file:
        file["time [s]"] = np.arange(400) / 1000
        file["\x1b[2Jforce [N]"], file["x [mm]"] = np.arange(400) % 7, np.arange(400) % 5
        file["\x1b[2Jforce [N]"].attrs["scale_factor"] = 0.001
    for command in (["look"], ["import", "--out", str(tmp_path / "r.h5")], ["look", "--json"]):
        assert main([*command, str(tmp_path / "others.h5")]) == 0
        said = capsys.readouterr().err
        assert "Note: Taken from the header: " in said and "scale_factor = 0.001 was not applied" in said
        assert "\x1b[2J" not in said


@pytest.mark.parametrize("notes", [5, "text", None, [["nested"], 3]])
def test_notes_of_an_import_that_are_none_end_no_look(lever, tmp_path, capsys, notes):
    write_recording(tmp_path / "a.h5", replace(lever, meta={"import": {"notes": notes}}))
    assert main(["look", str(tmp_path / "a.h5")]) == 0
    assert capsys.readouterr().err.count("Note: ") == (2 if isinstance(notes, list) else 0)


def test_names_in_a_file_do_not_move_the_cursor(lever, tmp_path, capsys):
    named = replace(lever, device="\x1b[2J", response=replace(lever.response, channels=("\x1b[1A",)))
    write_recording(tmp_path / "a.h5", named)
    for command in ("look", "show"):
        assert main([command, str(tmp_path / "a.h5")]) == 0
        assert "\x1b" not in capsys.readouterr().out


def test_validate_names_axes_that_no_command_drives(lever, tmp_path, capsys):
    two = Signal(np.column_stack([lever.command.samples, np.zeros(6000)]), RATE_HZ, "force", "N", ("fx", "fy"))
    write_recording(tmp_path / "idle.h5", replace(lever, command=two))
    assert main(["validate", str(tmp_path / "idle.h5")]) == 0
    assert "Note: No command drives fy." in capsys.readouterr().out


def test_validate_names_a_segment_in_which_nothing_is_driven(lever, tmp_path, capsys):
    silent = lever.command.samples.copy()
    silent[3000:] = 0.0
    write_recording(tmp_path / "a.h5", replace(lever, command=replace(lever.command, samples=silent)))
    assert main(["validate", str(tmp_path / "a.h5")]) == 1
    assert "Segment 2 is a noise of amplitude 5, but no command moves in it." in capsys.readouterr().out


@pytest.mark.parametrize(("axis", "code"), [("x", 0), ("fx", 0), ("w", 1)])
def test_validate_holds_the_axes_of_a_model_against_the_recording_beside_it(written, tmp_path, capsys, axis, code):
    (tmp_path / "m.toml").write_text(
        '[model]\nname = "m"\nquantity = "acceleration"\nmass = [[1]]\ndamping = [[1]]\nstiffness = [[0]]\n'
        f'input = [[1]]\noutput = [[1]]\n[[effect]]\nkind = "coulomb_friction"\naxis = "{axis}"\nlevel = 0.1\n'
    )
    assert main(["validate", str(tmp_path / "m.toml")]) == 0
    assert main(["validate", str(tmp_path / "m.toml"), str(written)]) == code
    said = capsys.readouterr().out
    assert ("With lever.h5: coulomb_friction: the axis 'w' is none of fx" in said) == bool(code)


def test_validate_names_unknown_units_of_a_map(tmp_path, capsys):
    channel = '[[channel]]\nrole = "{}"\nname = "x"\nvalue = "x"\nunit = "{}"\n'
    text = 'device = "rig"\n[[clock]]\nrate_hz = 100\n'
    (tmp_path / "m.toml").write_text(text + channel.format("command", "Newton") + channel.format("response", "in"))
    assert main(["validate", str(tmp_path / "m.toml")]) == 1
    said = capsys.readouterr().out
    assert "Command 'x': 'Newton' is not a unit known here" in said or "command 'x': 'Newton' is not" in said
    assert "response 'x'" not in said
