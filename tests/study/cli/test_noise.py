import errno
import os

import pytest
from scipy.io import wavfile

from study.cli.main import main


def test_a_sound_is_written_and_its_use_is_reported(tmp_path, capsys):
    out = tmp_path / "noise.wav"
    assert main(["noise", str(out), "--minutes", "0.05"]) == 0
    said = capsys.readouterr()
    assert said.out.strip() == str(out)
    for words in ("loop", "hand off the handle", "no longer hear the device", "80 dB(A)"):
        assert words in said.err
    rate_hz, samples = wavfile.read(out)
    assert samples.shape == (3 * rate_hz,)


def test_a_sound_that_is_there_is_not_overwritten(tmp_path, capsys):
    out = tmp_path / "noise.wav"
    out.write_bytes(b"mine")
    assert main(["noise", str(out), "--minutes", "0.05"]) == 1
    assert "Nothing that exists is overwritten." in capsys.readouterr().err
    assert out.read_bytes() == b"mine"


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["noise.mp3"], "noise.mp3 does not end in .wav."),
        (["noise.wav", "--low-hz", "500", "--high-hz", "100"], "not 500 to 100"),
        (["noise.wav", "--minutes", "600"], "--minutes"),
    ],
)
def test_noise_that_cannot_be_is_wrong_use(tmp_path, monkeypatch, capsys, arguments, sentence):
    monkeypatch.chdir(tmp_path)
    assert main(["noise", *arguments]) == 2
    assert sentence in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_a_full_disk_leaves_nothing_half_written(tmp_path, monkeypatch, capsys):
    def full(descriptor: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr("os.fsync", full)
    assert main(["noise", str(tmp_path / "noise.wav"), "--minutes", "0.05"]) == 1
    assert "The disk is full" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
