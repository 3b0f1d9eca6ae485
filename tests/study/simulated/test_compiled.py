import shutil
from pathlib import Path

from study.devices.simulated import compiled

FOLDER = Path(compiled.__file__).parent


def test_a_change_in_any_source_makes_the_kept_code_outdated(tmp_path):
    sources = sorted(FOLDER.glob("*.py"))
    for source in sources:
        shutil.copy(source, tmp_path)
    fingerprints = {compiled.compute_fingerprint(tmp_path)}
    for source in sources:
        changed = tmp_path / source.name
        changed.write_text(changed.read_text() + "\n# changed")
        fingerprints.add(compiled.compute_fingerprint(tmp_path))
    assert len(fingerprints) == 1 + len(sources)


def test_every_entry_point_encloses_the_fingerprint():
    expected = compiled.compute_fingerprint(FOLDER, FOLDER.parent / "rig.py")
    for entry in (compiled.sense, compiled.advance, compiled.solve_pose):
        assert expected in [cell.cell_contents for cell in entry.py_func.__closure__]
