"""Files that say more than they hold, or whose samples lie in other files: refused before anything is read."""

import os
import struct
import subprocess
import sys
import zipfile
import zlib
from pathlib import Path

import h5py
import numpy as np
import pytest
from scipy.io import savemat

from study.importing.arrays.read_arrays import read_arrays
from study.importing.map_format.import_map import CsvMap
from study.importing.map_format.map_errors import ImportRefusedError
from study.store.disk.declared_size import MAX_EXPANSION, MAX_LIMIT_BYTES, MIN_LIMIT_BYTES, SizeLimit
from study.store.disk.file_errors import UnusableFileError
from study.store.formats.identified_model_file import read_identified_model
from study.store.formats.recording_file import read_recording
from study.workflows.files.validate import validate_file

pytestmark = pytest.mark.timeout(60)

FROZEN = Path(__file__).parents[2] / "frozen" / "v0_1"

SECRET = b"root:x:0:0:root\n" * 100


@pytest.fixture
def recording(tmp_path) -> Path:
    path = tmp_path / "r.h5"
    path.write_bytes((FROZEN / "lever.h5").read_bytes())
    return path


def replaced(path: Path, name: str, *place, **how) -> None:
    """The dataset with its attributes kept, and all else as said."""
    with h5py.File(path, "r+") as file:
        kept = dict(file[name].attrs)
        del file[name]
        file.create_dataset(name, *place, **how).attrs.update(kept)


def refusals(path: Path) -> list[str]:
    """Of the reader of recordings, the validation and the import."""
    said = []
    for read in (read_recording, lambda path: read_arrays(path, CsvMap())):
        with pytest.raises((UnusableFileError, ImportRefusedError)) as refused:
            read(path)
        said.append(refused.value.happened)
    return [*said, *validate_file(path).problems]


def test_samples_in_another_file_are_not_read(recording, tmp_path):
    (tmp_path / "secret").write_bytes(SECRET)
    replaced(recording, "command", (50, 1), "f8", external=[(str(tmp_path / "secret"), 0, 400)])
    assert all("the samples of command lie in other files" in said.lower() for said in refusals(recording))


def test_samples_in_a_pipe_are_not_waited_for(recording, tmp_path):
    os.mkfifo(tmp_path / "pipe")
    replaced(recording, "command", (50, 1), "f8", external=[(str(tmp_path / "pipe"), 0, 400)])
    assert all("lie in other files" in said for said in refusals(recording))


def test_virtual_samples_are_not_read(recording, tmp_path):
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file["x"] = np.zeros((50, 1))
    layout = h5py.VirtualLayout((50, 1), "f8")
    layout[:] = h5py.VirtualSource(str(tmp_path / "other.h5"), "x", (50, 1))
    with h5py.File(recording, "r+") as file:
        del file["command"]
        file.create_virtual_dataset("command", layout)
    assert all("lie in other files" in said for said in refusals(recording))


@pytest.mark.parametrize("name", ["command", "beside", "meta/deep"])
def test_links_to_other_files_are_not_followed(recording, tmp_path, name):
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file["x"] = np.zeros((50, 1))
    with h5py.File(recording, "r+") as file:
        if name in file:
            del file[name]
        file[name] = h5py.ExternalLink(str(tmp_path / "other.h5"), "/x")
        file["by_way_of_it"] = h5py.SoftLink(f"/{name}")
    assert all(f"{name} is a link to another file".lower() in said.lower() for said in refusals(recording))


def test_groups_that_hold_themselves_are_walked_once(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["g/x"] = [1.0, 2.0]
        file["g/again"] = file["g"]
        file["alias"] = h5py.SoftLink("/g")
    assert list(read_arrays(tmp_path / "a.h5", CsvMap()).by_name) == ["g/x"]


@pytest.mark.parametrize(
    "how",
    [
        {"shape": (2**29, 1), "dtype": "f8", "chunks": (1000, 1)},
        {"shape": (2**29, 1), "dtype": "f8", "chunks": (1000, 1), "compression": "gzip", "fillvalue": 1.0},
        {"shape": (2**29, 1), "dtype": "f8"},
        {"shape": (2**29, 1), "dtype": "u1", "chunks": (1000, 1)},
        {"shape": (2**62, 1), "dtype": "f8", "chunks": (1000, 1)},
        {"shape": (2**20, 3), "dtype": h5py.ref_dtype, "chunks": (1000, 1)},
        {"shape": (2**40, 2**20), "dtype": "f2", "chunks": (1000, 1)},
    ],
)
def test_a_small_hdf5_file_that_declares_gigabytes_is_refused(recording, how):
    replaced(recording, "command", **how)
    assert recording.stat().st_size < 100_000
    assert all("declares" in said for said in refusals(recording))


def test_a_piece_that_unpacks_to_more_than_its_size_is_refused(recording):
    bomb = zlib.compress(bytes(2**26), 1)
    replaced(recording, "command", (50, 1), "f8", chunks=(50, 1), compression="gzip")
    with h5py.File(recording, "r+") as file:
        file["command"].id.write_direct_chunk((0, 0), bomb)
    assert all("unpacks to more" in said for said in refusals(recording))


def test_an_attribute_of_thousands_of_entries_is_refused(recording):
    with h5py.File(recording, "r+") as file:
        file["command"].attrs["unit"] = np.zeros(2000)
    with pytest.raises(UnusableFileError, match=r"attribute 'unit' of command has the shape \(2000,\)"):
        read_recording(recording)


def test_a_model_is_held_to_the_same(tmp_path):
    (tmp_path / "m.h5").write_bytes((FROZEN / "model.h5").read_bytes())
    replaced(tmp_path / "m.h5", "A", (2**15, 2**15), "f8", chunks=(100, 100))
    with pytest.raises(UnusableFileError, match="A declares 8589934592 bytes"):
        read_identified_model(tmp_path / "m.h5")


def header(shape: str, descr: str = "<f8") -> bytes:
    text = f"{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}".ljust(117) + "\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text.encode()


@pytest.mark.parametrize("shape", ["(536870912,)", "(-1,)", "(4294967296, 4294967296)", "(2, -2, -3)", "(True,)"])
def test_a_header_of_npy_that_says_more_than_there_is_is_refused(tmp_path, shape):
    (tmp_path / "a.npy").write_bytes(header(shape))
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive:
        archive.writestr("u.npy", header(shape))
    for name in ("a.npy", "a.npz"):
        with pytest.raises(ImportRefusedError):
            read_arrays(tmp_path / name, CsvMap())


@pytest.mark.parametrize("packing", [zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_an_archive_that_unpacks_to_much_more_than_itself_is_refused(tmp_path, packing):
    count = 2**24 + 1 if packing == zipfile.ZIP_DEFLATED else 1000
    with zipfile.ZipFile(tmp_path / "a.npz", "w", packing, compresslevel=1) as archive:
        archive.writestr("u.npy", header(f"({count},)") + bytes(8 * count))
    with pytest.raises(ImportRefusedError, match=r"declares|is packed in a way"):
        read_arrays(tmp_path / "a.npz", CsvMap())


def test_a_pickle_is_never_loaded(tmp_path):
    class Trap:
        def __reduce__(self):
            return os.mkdir, (str(tmp_path / "trapped"),)

    np.save(tmp_path / "a.npy", np.array([Trap()], dtype=object), allow_pickle=True)
    np.savez(tmp_path / "a.npz", bad=np.array([Trap()], dtype=object), u=[1.0, 2.0])
    (tmp_path / "b.npz").write_bytes(b"\x80\x04" + b"." * 50)
    assert list(read_arrays(tmp_path / "a.npz", CsvMap()).by_name) == ["u"]
    for name in ("a.npy", "b.npz"):
        with pytest.raises(ImportRefusedError):
            read_arrays(tmp_path / name, CsvMap())
    assert not (tmp_path / "trapped").exists()


def matrix(flags: int, dims: tuple[int, ...], name: bytes, rest: bytes) -> bytes:
    size = 8 * len(dims) // 2
    body = struct.pack("<IIII", 6, 8, flags, 0) + struct.pack("<II", 5, 4 * len(dims))
    body += struct.pack(f"<{len(dims)}i", *dims).ljust(-(-size // 8) * 8, b"\0")
    return wrapped(14, body + struct.pack("<II", 1, len(name)) + name.ljust(-(-len(name) // 8) * 8, b"\0") + rest)


def wrapped(kind: int, body: bytes) -> bytes:
    return struct.pack("<II", kind, len(body)) + body


def mat(*elements: bytes) -> bytes:
    return b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack("<H", 0x0100) + b"IM" + b"".join(elements)


def nested_cells(depth: int) -> bytes:
    inner = matrix(6, (1, 1), b"", wrapped(9, struct.pack("<d", 1.0)))
    for _ in range(depth):
        names = struct.pack("<HHI", 5, 4, 2) + wrapped(1, b"a\0\0\0\0\0\0\0"[:8])
        inner = matrix(2, (1, 1), b"", names + inner)
    return inner


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (mat(matrix(6, (2**15, 2**14), b"u", wrapped(9, b"\0" * 8))), "an array of the shape"),
        (mat(matrix(6, (-2, -4), b"u", wrapped(9, b"\0" * 64))), "an array of the shape"),
        (mat(wrapped(15, zlib.compress(bytes(2**27 + 9), 1))), "a compressed variable declares"),
        (mat(struct.pack("<II", 14, 2**31)), "is longer than the rest"),
        (mat(nested_cells(400)), "nested more than 32 levels"),
    ],
)
def test_a_mat_file_that_says_more_than_it_holds_is_refused(tmp_path, content, sentence):
    (tmp_path / "a.mat").write_bytes(content)
    with pytest.raises(ImportRefusedError) as refused:
        read_arrays(tmp_path / "a.mat", CsvMap())
    assert sentence in refused.value.happened.lower()


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize("kind", ["f8", "f4", "i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8"])
def test_what_scipy_writes_is_read_to_the_last_digit(tmp_path, kind, packed):
    u = (np.random.default_rng(1).normal(size=(7, 3, 2)) * 50).astype(kind)
    savemat(tmp_path / "a.mat", {"u": u, "s": {"v": u[0], "w": u[:1, 0, 0]}, "b": u > 0}, do_compression=packed)
    found = read_arrays(tmp_path / "a.mat", CsvMap()).by_name
    np.testing.assert_array_equal(found["u"], u)
    np.testing.assert_array_equal(found["s.v"], u[0])
    np.testing.assert_array_equal(found["s.w"], u[0, 0, 0])
    np.testing.assert_array_equal(found["b"], u > 0)


def test_an_hour_of_nine_channels_at_ten_kilohertz_is_within_the_limit():
    size = 3600 * 10_000 * 9 * 8
    SizeLimit(size // MAX_EXPANSION).add_size("it", size)
    assert MIN_LIMIT_BYTES < size < MAX_LIMIT_BYTES


@pytest.mark.slow
def test_memory_is_taken_for_nothing_that_is_only_declared(tmp_path, recording):
    """In a process that may have 2 GB of addresses in all."""
    replaced(recording, "command", (2**29, 1), "f8", chunks=(1000, 1))
    (tmp_path / "a.npy").write_bytes(header("(536870912,)"))
    script = (
        "import resource, sys\nfrom pathlib import Path\nfrom study.workflows.files.validate import validate_file\n"
        "from study.importing.arrays.read_arrays import read_arrays\n"
        "from study.importing.map_format.import_map import CsvMap\n"
        "from study.errors import StudyError\nresource.setrlimit(resource.RLIMIT_AS, (2**31, 2**31))\n"
        "print(validate_file(Path(sys.argv[1])).problems[0])\n"
        "try: read_arrays(Path(sys.argv[2]), CsvMap())\nexcept StudyError as refused: print(refused.happened)"
    )
    done = subprocess.run(
        [sys.executable, "-c", script, recording, tmp_path / "a.npy"], capture_output=True, text=True, check=True
    )
    assert "declares" in done.stdout and "4294967296 bytes, but holds" in done.stdout, done.stdout
