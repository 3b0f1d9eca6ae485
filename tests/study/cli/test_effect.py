"""`hapteq effect` from the command line."""

from pathlib import Path

from typer.testing import CliRunner

from equalizer.laws.law import parse_law
from equalizer.plant.mechanical_model import MechanicalModel, ModelEffect
from study.cli.main import app
from study.store.formats.mechanical_model_file import write_mechanical_model


def test_a_law_of_a_model_is_kept_as_an_effect(tmp_path: Path):
    law = parse_law("-4.1*abs(vx)**1.5*sign(vx)", "force", "x")
    one = [[1.0]]
    effects = (ModelEffect("discovered_law", "x", {}, law),)
    write_mechanical_model(
        tmp_path / "improved.toml", MechanicalModel("one", "position", one, one, one, one, one, effects=effects)
    )
    out = tmp_path / "my_effect.py"
    result = CliRunner().invoke(app, ["effect", str(tmp_path / "improved.toml"), "--out", str(out)])
    assert result.exit_code == 0, result.output
    assert "my_effect: -4.1*abs(vx)**1.5*sign(vx), acts on force, found at x." in result.output
    assert "expression='-p0*abs(vx)**p1*sign(vx)'" in out.read_text()
