import numpy as np
import pytest
from scipy.io import wavfile

from study.store.disk.file_errors import AlreadyExistsError
from study.store.disk.wav_file import write_wav

SAMPLES = np.array([0, 1, -1, 32767, -32768], dtype=np.int16)


def test_another_reader_finds_the_same_samples(tmp_path):
    write_wav(tmp_path / "a.wav", SAMPLES, 44_100)
    rate_hz, read = wavfile.read(tmp_path / "a.wav")
    assert (rate_hz, read.dtype) == (44_100, np.int16)
    assert np.array_equal(read, SAMPLES)


def test_a_sound_that_is_there_stays(tmp_path):
    (tmp_path / "a.wav").write_bytes(b"mine")
    with pytest.raises(AlreadyExistsError):
        write_wav(tmp_path / "a.wav", SAMPLES, 44_100)
    assert (tmp_path / "a.wav").read_bytes() == b"mine"
