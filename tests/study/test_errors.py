import pickle
from pathlib import Path

import pytest

from study.errors import DeviceError, ExitCode, StudyError, WrongUseError
from study.store.disk.file_errors import AlreadyExistsError, UnusableFileError


@pytest.mark.parametrize(
    "error",
    [
        StudyError("Title", "It happened.", "Do this.", saved="All is safe."),
        DeviceError("Title", "It happened.", "Do this."),
        AlreadyExistsError(Path("a.h5")),
        UnusableFileError(Path("a.h5"), "recording", ("it is empty",)),
    ],
)
def test_an_error_survives_the_way_from_a_worker_process(error):
    back = pickle.loads(pickle.dumps(error))
    assert type(back) is type(error)
    assert str(back) == str(error)
    assert back.__dict__ == error.__dict__
    assert back.exit_code == error.exit_code


def test_an_error_says_what_happened_what_is_safe_and_what_to_do():
    error = StudyError("The disk is full", "Nothing fits.", "Make room.", saved="13 answers are on disk.")
    assert str(error) == "The disk is full. Nothing fits. 13 answers are on disk. Make room."


def test_the_exit_codes_are_a_contract():
    codes = {code.name: int(code) for code in ExitCode}
    assert codes == {"DONE": 0, "ERROR": 1, "WRONG_USE": 2, "DEVICE": 3, "INTERRUPTED": 130}
    assert WrongUseError("t", "h", "d").exit_code == 2
    assert DeviceError("t", "h", "d").exit_code == 3
