import os

import pytest

from study.tui.line_mode.line_input import LineInput


@pytest.fixture
def pipe():
    read, write = os.pipe()
    return LineInput(read), write


def test_lines_come_one_by_one_and_nothing_is_none(pipe):
    lines, write = pipe
    os.write(write, b"1\n2\nhal")
    assert [lines.read(0.0), lines.read(0.0), lines.read(0.0)] == ["1", "2", None]
    os.write(write, b"f\n")
    assert lines.read(0.0) == "half"


def test_the_end_of_the_input_is_reported(pipe):
    lines, write = pipe
    os.write(write, b"1\n")
    os.close(write)
    assert lines.read(0.0) == "1"
    with pytest.raises(EOFError):
        lines.read(0.0)


def test_the_last_line_of_a_pipe_needs_no_line_end(pipe):
    lines, write = pipe
    os.write(write, b"1\n2")
    os.close(write)
    assert lines.read(0.0) == "1"
    assert not lines.has_ended()
    assert lines.read(0.0) == "2"
    assert lines.has_ended()
    with pytest.raises(EOFError):
        lines.read(0.0)


def test_what_is_typed_without_enter_is_no_line(pipe):
    lines, write = pipe
    lines.is_interactive = True  # a terminal whose person types 1 and twice Ctrl-D
    os.write(write, b"1")
    os.close(write)
    assert lines.read(0.0) is None
    assert lines.has_ended()
    with pytest.raises(EOFError):
        lines.read(0.0)


def test_an_input_has_ended_only_when_its_last_line_was_taken(pipe):
    lines, write = pipe
    assert not lines.has_ended()
    os.write(write, b"1\n")
    os.close(write)
    assert not lines.has_ended()
    assert lines.read(0.0) == "1"
    assert lines.has_ended()
    assert lines.has_ended()
