"""Damaged or malicious measurement files: bounded memory and time, and an error of one sentence."""

import random
import subprocess
import sys
import time
import zlib
from functools import cache

import h5py
import nptdms
import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest
from scipy.io import savemat

import eft
from eft.traces import read_traces

TIME = np.arange(4000) / 1000.0
MANY = 8_000_000


def save(path, arrays, packed=True):
    """The arrays in the format that the suffix names."""
    if path.suffix == ".mat":
        savemat(path, arrays, do_compression=packed)
    elif path.suffix == ".h5":
        with h5py.File(path, "w") as file:
            for name, array in arrays.items():
                file.create_dataset(name, data=array, compression="gzip" if packed else None)
    elif path.suffix == ".tdms":
        with nptdms.TdmsWriter(str(path)) as writer:
            writer.write_segment([nptdms.ChannelObject("test", *item) for item in arrays.items()])
    elif path.suffix == ".csv":
        rows = np.column_stack(list(arrays.values()))
        np.savetxt(path, rows, "%.7g", ",", header=",".join(arrays), comments="")
    else:
        pyarrow.parquet.write_table(pa.table(arrays), path, compression="zstd" if packed else None)
    return path


@pytest.mark.parametrize("suffix", [".mat", ".h5", ".parquet", ".tdms", ".csv"])
def test_numbers_of_another_length_or_kind_than_float_are_read(suffix, tmp_path):
    counts = np.arange(4000, dtype=np.int16)
    path = save(tmp_path / f"a{suffix}", {"time_s": TIME, "force_kN": counts, "mood": counts})
    traces = read_traces(path)
    assert traces["force"] == pytest.approx(counts * 1e3) and traces.ignored == ("mood",)


@pytest.mark.parametrize("suffix", [".mat", ".h5", ".parquet"])
def test_a_small_file_of_many_numbers_is_refused_before_they_take_memory(suffix, tmp_path, peak_memory):
    path = save(tmp_path / f"a{suffix}", {"time_s": np.zeros(MANY), "force_N": np.zeros(MANY)})
    with peak_memory(0.5):
        pass  # frees the memory of writing
    # Less than one of the two columns takes; MAT decompresses up to half of its free memory to count.
    allowed = 60 if suffix == ".mat" else 16
    with (
        peak_memory(allowed),
        pytest.raises(ValueError, match=r"declares \d+ MiB of numbers, must be at most|unpacks from"),
    ):
        read_traces(path)


@pytest.mark.parametrize("suffix", [".mat", ".h5", ".parquet", ".tdms"])
def test_columns_that_are_not_known_take_no_memory(suffix, tmp_path, peak_memory):
    more = np.arange(1_500_000) / 1000.0
    unknown = {f"mood{i}": more for i in range(8)}
    path = save(tmp_path / f"a{suffix}", {"time_s": more, **unknown, "force_N": more}, packed=False)
    of_one = more.nbytes / 1024**2
    with peak_memory(2 * of_one + 64):
        assert len(read_traces(path)) == more.size


def test_text_takes_the_memory_of_its_columns(tmp_path, peak_memory):
    path = tmp_path / "a.csv"
    rows = 400_000
    rest = ",1.5" + ",1.23456789" * 20 + "\n"
    with path.open("w") as file:
        file.write("time (s),force (N)" + "".join(f",mood{i}" for i in range(20)) + "\n")
        file.writelines(f"{i / 1000:.3f}{rest}" for i in range(1000))
    read_traces(path)
    with path.open("a") as file:
        file.writelines(f"{i / 1000:.3f}{rest}" for i in range(1000, rows))
    # Time and force are kept; all columns would be 70 MB.
    with peak_memory(2 * 8 * rows / 1024**2 + 32):
        assert len(read_traces(path)) == rows


def test_a_record_takes_no_more_than_64_mib_besides_its_points(tmp_path, peak_memory):
    path = tmp_path / "a.csv"
    rows = 740_000
    with path.open("w") as file:
        file.write("time (s),acceleration (g)\n")
        file.writelines(f"{i / 200:.3f},0.123456789012345678\n" for i in range(rows))
    with peak_memory(8 * rows / 1024**2 + 64):
        assert len(eft.read_record(path)) == rows
    with path.open("a") as file:
        file.write("# " + "x" * 10_000_000)
    with peak_memory(64), pytest.raises(ValueError, match="24 MiB"):
        eft.read_record(path)


def test_a_universal_file_of_short_lines_or_of_many_is_refused(tmp_path, peak_memory):
    path = tmp_path / "a.uff"
    for text, says in (("\n" * 7_000_000, "7000002 lines"), ("x" * 80 * 110_000, "8 MiB")):
        path.write_text("    -1\n    58\n" + text)
        with peak_memory(64), pytest.raises(ValueError, match=says):
            read_traces(path)


def test_a_tdms_file_that_declares_more_than_it_has(tmp_path, peak_memory):
    path = save(tmp_path / "a.tdms", {"time_s": TIME, "force_N": TIME})
    whole = path.read_bytes()
    count = TIME.size.to_bytes(8, "little")
    for declared in (10**15, 2**63 - 1):
        path.write_bytes(whole.replace(count, declared.to_bytes(8, "little")))
        with peak_memory(64), pytest.raises(ValueError, match=r"a\.tdms"):
            read_traces(path)


def test_a_column_that_is_not_known_cannot_hide_a_large_page(tmp_path, peak_memory):
    notes = ["x" * 70_000_000] + [""] * (TIME.size - 1)
    path = save(tmp_path / "a.parquet", {"time_s": TIME, "force_N": TIME, "note": notes})
    del notes
    with peak_memory(64), pytest.raises(ValueError, match=r"declares \d+ MiB for 4000 rows"):
        read_traces(path)


def test_hdf5_that_allocates_or_reaches_out(tmp_path, peak_memory):
    path = tmp_path / "a.h5"
    other = tmp_path / "other.bin"
    other.write_bytes(bytes(8 * 4000))
    plain = {"shape": (4000,), "dtype": "f8"}
    for says, make in {
        r"declares \d+ MiB": lambda file: file.create_dataset(
            "force_N", (2 * 10**9,), "f8", fillvalue=1.0, chunks=(1024,)
        ),
        "chunks of": lambda file: file.create_dataset(
            "force_N", **plain, data=TIME, chunks=(8_000_000,), maxshape=(None,), compression="gzip"
        ),
        "in other files": lambda file: file.create_dataset(
            "force_N", **plain, external=[(str(other), 0, 8 * 4000)]
        ),
        "more than once": lambda file: twice(file),
        "unpacks to more than": lambda file: unpacks(file),
        "larger packed than unpacked": lambda file: unpacks(file, 100),
    }.items():
        with h5py.File(path, "w") as file:
            make(file)
        with peak_memory(80), pytest.raises(ValueError, match=says):
            read_traces(path, sample_rate=1000.0)


def twice(file):
    settings = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    settings.set_chunk((4000,))
    settings.set_deflate(9)
    settings.set_deflate(9)
    h5py.h5d.create(file.id, b"force_N", h5py.h5t.NATIVE_DOUBLE, h5py.h5s.create_simple((4000,)), settings)


@cache
def bomb():
    return zlib.compress(bytes(100_000_000), 1)


def unpacks(file, chunk=100_000):
    item = file.create_dataset("force_N", (chunk,), "f8", chunks=(chunk,), compression="gzip")
    item.id.write_direct_chunk((0,), bomb())


def test_a_virtual_data_set_is_refused(tmp_path):
    path = tmp_path / "a.h5"
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file["force"] = TIME
    layout = h5py.VirtualLayout((4000,), "f8")
    layout[:] = h5py.VirtualSource(tmp_path / "other.h5", "force", (4000,))
    with h5py.File(path, "w") as file:
        file.create_virtual_dataset("force_N", layout)
    with pytest.raises(ValueError, match="in other files"):
        read_traces(path, sample_rate=1000.0)


def test_a_mat_array_that_holds_more_than_its_dimensions_say(tmp_path, peak_memory):
    path = save(tmp_path / "a.mat", {"force_N": np.zeros(12_000_000)}, packed=False)
    head, whole = path.read_bytes()[:128], bytearray(path.read_bytes()[128:])
    whole[36:40] = (10).to_bytes(4, "little")  # the second of its dimensions: 1 × 10
    packed = zlib.compress(whole, 1)
    del whole
    compressed = 15
    path.write_bytes(head + b"".join(n.to_bytes(4, "little") for n in (compressed, len(packed))) + packed)
    with peak_memory(64), pytest.raises(ValueError, match=r"unpacks from|numbers unpacks to"):
        read_traces(path, sample_rate=1000.0)


def complaint(read, path):
    """The error of a reader for a file; empty if it reads the file."""
    try:
        read(path)
    except ValueError as error:
        return str(error)
    return ""


@pytest.mark.parametrize("suffix", [".mat", ".h5", ".parquet", ".tdms", ".csv"])
def test_damaged_files_are_one_sentence(suffix, tmp_path, peak_memory):
    chance = random.Random(7)
    # Damage is in the first and the last 2000 bytes, and each line of a text takes its time.
    times = TIME[:1000] if suffix == ".csv" else TIME
    saved = save(tmp_path / f"whole{suffix}", {"time_s": times, "force_N": np.sin(times)}).read_bytes()
    path = tmp_path / f"a{suffix}"
    refused = 0
    with peak_memory(250):
        for _ in range(100):
            data = bytearray(saved)
            if chance.random() < 0.2:
                del data[chance.randrange(len(data)) :]
            for _ in range(chance.randint(1, 3)):
                at = chance.randrange(-min(len(data), 2000), min(len(data), 2000)) if data else 0
                data[at : at + 1] = bytes([chance.randrange(256)])
            path.write_bytes(data)
            if said := complaint(read_traces, path):
                refused += 1
                assert said.startswith(f"{path}") and "\n" not in said
    # Text and raw numbers may change without harm.
    assert refused > (10 if suffix in (".tdms", ".csv") else 20)


@pytest.mark.parametrize("size", [0, 2**64 - 16])
def test_an_hdf5_heap_without_end_is_refused(size, tmp_path):
    path = save(tmp_path / "a.h5", {"time": TIME, "force": TIME})
    with h5py.File(path, "r+") as file:
        file["time"].attrs["units"], file["force"].attrs["units"] = "s", "N"
    whole = path.read_bytes()
    assert read_traces(path)["force"].size == TIME.size
    object_at = whole.index(b"GCOL") + 16
    # Object 0 is the free space.
    number = 0 if size == 0 else 1
    about = number.to_bytes(2, "little") + bytes(6) + size.to_bytes(8, "little")
    path.write_bytes(whole[:object_at] + about + whole[object_at + 16 :])
    code = (
        f"from eft.traces import read_traces\ntry: read_traces({str(path)!r})\n"
        "except ValueError as error: print(error)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=20
    )
    expected = f"{path}: not an HDF5 file that can be read: an object of a heap takes 0 bytes\n"
    assert done.stdout == expected


def test_a_damaged_tdms_file_writes_nothing_to_the_terminal(tmp_path):
    path = save(tmp_path / "a.tdms", {"time_s": TIME, "force_N": TIME})
    whole = path.read_bytes()
    name = b"\x10\x00\x00\x00/'test'/'time_s'"
    assert name in whole
    # A name as long as the rest of the file, and a last segment that is cut off.
    path.write_bytes(whole.replace(name, b"\xff\xff" + name[2:]))
    (tmp_path / "b.tdms").write_bytes(whole[:-1000])
    code = (
        "import sys, eft.traces\nfor path in sys.argv[1:]:\n"
        "  try: eft.traces.read_traces(path)\n  except ValueError: print('refused')"
    )
    call = [sys.executable, "-c", code, path, tmp_path / "b.tdms"]
    done = subprocess.run(call, capture_output=True, text=True, check=True)
    assert done.stdout == "refused\nrefused\n" and done.stderr == ""


@pytest.mark.parametrize("missing", [4, 8, 1000])
def test_a_truncated_tdms_file_is_refused(tmp_path, missing):
    path = save(tmp_path / "a.tdms", {"time_s": TIME, "force_N": TIME})
    path.write_bytes(path.read_bytes()[:-missing])
    with pytest.raises(ValueError, match=r"a\.tdms: its last segment is incomplete"):
        read_traces(path)


def test_a_long_header_takes_no_time(tmp_path):
    path = tmp_path / "a.csv"
    gap = " " * 100_000
    rows = "".join(f"{t:.3f},1\n" for t in TIME)
    began = time.monotonic()
    for header in (f"time (s),force{gap}(N)\n", f"time (s),force (N){gap}\n"):
        path.write_text(header + rows)
        assert read_traces(path)["force"].size == TIME.size
    path.write_text(f"time (s),a{gap}b\n{rows}")
    with pytest.raises(ValueError, match="no known column"):
        read_traces(path)
    assert time.monotonic() - began < 5.0


@pytest.mark.parametrize("step", [1e-300, 1e300])
def test_a_clock_of_no_measurement_is_refused(step, tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("time (s),force (N)\n" + "".join(f"{i * step!r},1\n" for i in range(3)))
    with pytest.raises(ValueError, match=r"a step of 1e[+-]300 s: must lie within"):
        read_traces(path)
    with pytest.raises(ValueError, match=r"sample_rate = .*: must lie within"):
        read_traces(path, sample_rate=step)


@pytest.mark.parametrize("packed", [False, True])
def test_a_complex_mat_array_is_left_out(packed, tmp_path):
    force = np.linspace(-3.3, 7.7, TIME.size)
    path = save(tmp_path / "a.mat", {"t_s": TIME, "force_N": force, "velocity": 1j * force}, packed)
    assert np.array_equal(read_traces(path)["force"], force)


@pytest.mark.parametrize("kind", [0, 8, 10, 20, 200])
def test_a_mat_array_of_an_unknown_type_is_refused(kind, tmp_path):
    """SciPy looks the type up without a check, and ends the process at one that does not exist."""
    force = np.linspace(-3.3, 7.7, TIME.size)
    path = save(tmp_path / "a.mat", {"t_s": TIME, "force_N": force}, packed=False)
    content = bytearray(path.read_bytes())
    content[content.index(force.tobytes()) - 8] = kind
    path.write_bytes(content)
    with pytest.raises(ValueError, match=f"numbers of type {kind}"):
        read_traces(path)


def test_a_mat_array_whose_parts_lie_far_behind_its_end_is_refused(tmp_path, peak_memory):
    path = save(tmp_path / "a.mat", {"t_s": TIME, "force_N": TIME}, packed=False)
    content = bytearray(path.read_bytes())
    # The length of the first array's dimensions, after the file's header, the array's and its flags.
    assert content[156:160] == (8).to_bytes(4, "little")
    content[156:160] = (2**32 - 1).to_bytes(4, "little")
    path.write_bytes(content)
    with peak_memory(16), pytest.raises(ValueError, match="numbers of type 0"):
        read_traces(path)
