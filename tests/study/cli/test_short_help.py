"""`-h` is `--help`, on every command and sub-command."""

import pytest
import typer
from typer.testing import CliRunner

from study.cli.main import app


def commands(command, path=()):
    yield path
    for name, inner in getattr(command, "commands", {}).items():
        yield from commands(inner, (*path, name))


@pytest.mark.parametrize("path", list(commands(typer.main.get_command(app))), ids=" ".join)
def test_the_short_option_says_what_the_long_one_says(path):
    short, long = (CliRunner().invoke(app, [*path, option]) for option in ("-h", "--help"))
    assert short.exit_code == 0
    assert short.output == long.output
    assert "-h, --help" in short.output


GROUPS = [command for command in commands(typer.main.get_command(app)) if command in ((), ("kit",), ("protocol",))]


@pytest.mark.parametrize("path", GROUPS, ids=lambda path: " ".join(path) or "hapteq")
def test_lists_of_commands_are_whole_at_80_columns(path):
    usage, *lines = CliRunner().invoke(app, [*path, "-h"], env={"COLUMNS": "80"}).output.splitlines()
    assert usage.startswith("Usage:")
    assert max(map(len, lines)) <= 80
    assert not [line for line in lines if "..." in line]


def test_every_command_stands_under_a_heading():
    said = CliRunner().invoke(app, ["-h"]).output
    assert [line for line in said.splitlines() if line.endswith(":") and not line.startswith(" ")] == [
        "Options:", "Study:", "Analysis:", "Device:", "Diagnosis:", "Evaluation:",
    ]  # fmt: skip


def test_a_shell_can_complete_commands():
    asked = {"_HAPTEQ_COMPLETE": "complete_bash", "COMP_WORDS": "hapteq stud", "COMP_CWORD": "1"}
    said = CliRunner().invoke(app, [], env=asked, prog_name="hapteq").output
    assert "study" in said.split()
