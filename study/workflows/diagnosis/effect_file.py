"""Save discovered laws as Python files (effect files) and load them, as candidates of a later diagnosis.

A diagnosis compares a catalogue of known physical effects, and may discover a formula without a name. Saved under a
name (`hapteq effect`), the formula joins the catalogue's effects in diagnoses of other recordings (--effect-file).
Loading a file runs its code: load only files from a trusted source.
"""

import importlib.util
import math
import re
from collections.abc import Sequence
from pathlib import Path

from analysis.diagnosis.document import Diagnosis
from equalizer.effects.law_entry import LawEntry, make_library_effects
from equalizer.laws.law import Law, parse_law
from equalizer.laws.parse import LawError
from equalizer.plant.effect_vocabulary import DISCOVERED_LAW, EFFECTS_BY_NAME
from equalizer.signals.recording import Recording
from study.errors import StudyError
from study.store.disk.text_file import write_text
from study.store.formats.diagnosis_file import read_diagnosis
from study.store.formats.mechanical_model_file import read_mechanical_model

EFFECT_NAME_PATTERN = re.compile(r"[a-z][a-z0-9_]{0,63}")
"""Valid name of an effect, and of its file without `.py`."""
EFFECT_TEMPLATE = """\"\"\"{about}\"\"\"

from equalizer.effects.law_entry import LawEntry
from equalizer.laws.law import Law

ENTRY = LawEntry(
    name={name!r},
    # p0, p1, ... are free; a fit starts from `numbers` (a single one: (3.0,)), and force factors from a linear
    # regression.
    law=Law(
        expression={expression!r},
        numbers={numbers!r},
        units={units!r},
        acts_on={acts_on!r},
        axis={axis!r},
    ),
    source={source!r},
    # Ends the sentence that names it.
    signature={signature!r},
)
"""
"""Template of an effect file, filled in by `write_entry`."""


def write_entry(source: Path, out_path: Path, number: int = 1) -> LawEntry:
    """Write a law of a diagnosis (folder or JSON) or of a model (TOML) as an effect file. number: which law, in the
    order of `_read_laws`, at least 1. Raises StudyError if there is no such law, if `out_path` exists, or if its name
    is not valid or is in the catalogue."""
    laws = _read_laws(source)
    if number > len(laws):
        content_text = f"holds {len(laws)} law{'s' if len(laws) > 1 else ''}" if laws else "holds no discovered law"
        raise _make_effect_error(
            f"{source} {content_text}.", "Give a diagnosis or model that has one, or another --number."
        )
    if (
        out_path.suffix != ".py"
        or not EFFECT_NAME_PATTERN.fullmatch(out_path.stem)
        or out_path.stem in (*EFFECTS_BY_NAME, DISCOVERED_LAW)
    ):
        raise _make_effect_error(
            f"'{out_path.name}' cannot be an effect's name.",
            "Choose a name of small letters, digits and _ that is not in the catalogue, such as my_effect.py.",
        )
    law = laws[number - 1]
    signature = "it varies as the formula states"  # without the signals: at another axis these have other names
    docstring_text = f"Discovered law without a name: {law.text} (acts on the {law.acts_on} at {law.axis})."
    entry = LawEntry(out_path.stem, law, f"found by hapteq: {source.name}", signature)
    write_text(
        out_path,
        EFFECT_TEMPLATE.format(
            # Escaped: the texts come from a file, and an unescaped quote would end the docstring and run as code.
            about=docstring_text.replace("\\", r"\\").replace('"', r"\""),
            name=entry.name, expression=law.expression, numbers=law.numbers, units=law.units, acts_on=law.acts_on,
            axis=law.axis, source=entry.source, signature=entry.signature,
        ),
    )  # fmt: skip
    return entry


def read_entries(paths: Sequence[Path], recordings: Sequence[Recording]) -> tuple[LawEntry, ...]:
    """Load effect files for a diagnosis of these recordings. Raises StudyError for an invalid file, and for a law that
    reads a signal that a recording lacks. Returns the entries in the order of `paths`."""
    entries = tuple(read_entry(path) for path in paths)
    for path, entry in zip(paths, entries, strict=True):
        for recording in recordings:
            try:
                make_library_effects((entry,), recording)
            except LawError as error:
                raise _make_effect_error(
                    f"{path} does not fit the recordings: {error}.",
                    "Give it a law of signals that all recordings have, or leave --effect-file out.",
                ) from error
    return entries


def read_entry(path: Path) -> LawEntry:
    """Load an effect file by running it. Raises StudyError if it does not exist, is no Python file, fails, or defines
    no ENTRY with a valid name that is not in the catalogue."""
    module_spec = importlib.util.spec_from_file_location(f"hapteq_effect_{path.stem}", path)
    if not path.is_file() or module_spec is None or module_spec.loader is None:
        problem = "is no Python file (.py)" if path.is_file() else "is not there"
        raise _make_effect_error(f"{path} {problem}.", "Write one with `hapteq effect FOUND --out EFFECT.py`.")
    module = importlib.util.module_from_spec(module_spec)
    try:
        module_spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:
        reason = str(error) or type(error).__name__
        raise _make_effect_error(f"{path} fails: {reason}.", "Correct it, or leave --effect-file out.") from error
    entry = getattr(module, "ENTRY", None)
    catalogue_names = (*EFFECTS_BY_NAME, DISCOVERED_LAW)
    if not isinstance(entry, LawEntry) or entry.name in catalogue_names or not _has_valid_fields(entry):
        raise _make_effect_error(
            f"{path} defines no ENTRY of texts, with a valid name that is not in the catalogue, and a Law of finite "
            "numbers, with texts as axis and units.",
            "Write one with `hapteq effect FOUND --out EFFECT.py`, and change that.",
        )
    return entry


def _has_valid_fields(entry: LawEntry) -> bool:
    """Whether the fields of an entry, which a user may have changed, are of their types, its name is valid, and the
    numbers of its law are finite."""
    law: object = entry.law
    if not isinstance(law, Law):
        return False
    texts: tuple[object, ...] = (entry.name, entry.source, entry.signature, law.axis, *(law.units or ()))
    if not all(isinstance(text, str) for text in texts):
        return False
    numbers: tuple[object, ...] = law.numbers
    are_finite = (isinstance(number, int | float) and math.isfinite(number) for number in numbers)
    return bool(EFFECT_NAME_PATTERN.fullmatch(entry.name)) and all(are_finite)


def _read_laws(source: Path) -> list[Law]:
    """Read the discovered laws of a diagnosis (effects first, then candidates) or of a model file (.toml), in their
    order. Raises StudyError for a file that cannot be read."""
    if source.suffix == ".toml":
        return [effect.law for effect in read_mechanical_model(source).effects if effect.law is not None]
    document: Diagnosis = read_diagnosis(source / "diagnosis.json" if source.is_dir() else source)
    laws = [effect.law for effect in document.effects] + [candidate.law for candidate in document.candidates]
    return [parse_law(law.expression, law.acts_on, law.axis) for law in laws if law is not None]


def _make_effect_error(explanation: str, advice: str) -> StudyError:
    """Make the error for a law or an effect file that cannot be used."""
    return StudyError("The effect cannot be used", explanation, advice, saved="Nothing was written.")
