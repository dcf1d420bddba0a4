"""The readers that `damage.py` tries: each makes its sound example, damages it, and reads it."""

from __future__ import annotations

import contextlib
import io
import shutil
import socket
import struct
import threading
import tomllib
from pathlib import Path
from random import Random
from typing import Protocol

import damages
import numpy as np

import eft
from eft.cli import main
from eft.opensees import Site, serve
from eft.traces import read_traces

RIG = eft.Rig.zhao2005()
COMMAND = eft.sine_sweep(8900.0, 0.5, 4.0, 0.5, 256.0)
GRID = {"compensation.mode": ["off", "linear", "nonlinear"], "servovalve.flow_gain_scale": [0.95, 1.0]}
TIME = np.arange(500) / 1000.0


class Reader(Protocol):
    """A kind of input, in a folder of its own."""

    def __init__(self, folder: Path) -> None: ...

    def damage(self, chance: Random) -> None:
        """Write a damaged example."""

    def read(self, chance: Random) -> None:
        """Read it; ValueError or OSError if it is refused."""


def command(*names: object) -> None:
    """Run `eft`; ValueError with its message if it refuses the input, AssertionError if it ends otherwise."""
    said = io.StringIO()
    with contextlib.redirect_stderr(said):
        code = main([str(name) for name in names])
    if code == 2:
        raise ValueError(said.getvalue().removesuffix("\n"))
    assert code in (0, 1), f"exit code {code}: {said.getvalue()}"


def samples_of(plan: str) -> float:
    """The number of samples of a test's TOML; 0 if it has none."""
    with contextlib.suppress(ValueError, LookupError, TypeError, OverflowError):
        test = tomllib.loads(plan)
        return float(test["command"]["duration"] * test["controller"]["sample_rate"])
    return 0.0


class Run:
    """A run file: `TestRun.load`, and for some of those that load a report or a comparison."""

    def __init__(self, folder: Path) -> None:
        self.file = folder / "run.eft"
        adaptive = {"compensation.adaptive": True, "servovalve.flow_gain_scale": 0.95}
        runs = [eft.simulate(rig, COMMAND) for rig in (RIG, RIG.replace(adaptive))]
        self.sound = [run.save(self.file).read_bytes() for run in runs]

    def damage(self, chance: Random) -> None:
        self.file.write_bytes(damages.of_archive(chance.choice(self.sound), chance))

    def read(self, chance: Random) -> None:
        run = eft.TestRun.load(self.file)
        assert len(run) and run.metrics is not None and str(run)
        if chance.random() < 0.05:
            command("report", self.file, "-o", self.file.with_suffix(".html"))
        elif chance.random() < 0.2:
            command("compare", self.file, self.file)


class Traces:
    """Measurements as text, MATLAB, HDF5, Parquet or TDMS: `read_traces`, and some by `eft compare`."""

    def __init__(self, folder: Path) -> None:
        import h5py
        import nptdms
        import pyarrow as pa
        import pyarrow.parquet
        from scipy.io import savemat

        self.folder, self.file = folder, folder
        values = {"time_s": TIME, "force_N": 1e3 * np.sin(TIME), "command_N": 1e3 * np.cos(TIME)}
        savemat(folder / "a.mat", values, do_compression=True)
        savemat(folder / "b.mat", values)
        with h5py.File(folder / "a.h5", "w") as file:
            for name, array in values.items():
                file.create_dataset(name, data=array, compression="gzip")
        pa.parquet.write_table(pa.table(values), folder / "a.parquet")
        with nptdms.TdmsWriter(str(folder / "a.tdms")) as writer:
            writer.write_segment([nptdms.ChannelObject("test", *item) for item in values.items()])
        rows = np.column_stack(list(values.values()))
        np.savetxt(folder / "a.csv", rows, "%.7g", ",", header=",".join(values), comments="")
        self.sound = {file.name: file.read_bytes() for file in folder.iterdir()}

    def damage(self, chance: Random) -> None:
        name = chance.choice(list(self.sound))
        data, self.file = self.sound[name], self.folder / f"damaged-{name}"
        if name.endswith(".csv") and chance.random() < 0.5:
            changed = damages.of_text(data.decode(), chance).encode()
        else:
            changed = damages.of_bytes(data, chance)
        self.file.write_bytes(changed)

    def read(self, chance: Random) -> None:
        read_traces(self.file)
        if chance.random() < 0.1:
            command("compare", self.file, self.folder / "a.csv")


class Study:
    """A study's folder: `Study.load`, all columns, a run; some are reported by `eft report`, or resumed."""

    def __init__(self, folder: Path) -> None:
        self.sound, self.folder = folder / "sound", folder / "a.study"
        eft.study(RIG, COMMAND, GRID, output=self.sound, chunk=4, traces=True)

    def damage(self, chance: Random) -> None:
        shutil.rmtree(self.folder, ignore_errors=True)
        shutil.copytree(self.sound, self.folder)
        files = sorted(file for file in self.folder.rglob("*") if file.is_file())
        file = chance.choice([self.folder / "_study.json", self.folder / "part-000000.parquet", *files])
        if file.suffix == ".json":
            text = damages.of_json_text(file.read_text("utf-8"), chance)
            file.write_text(text, "utf-8", errors="surrogatepass")
        elif file.suffix == ".eft":
            file.write_bytes(damages.of_archive(file.read_bytes(), chance))
        elif chance.random() < 0.1:
            file.unlink()
        else:
            file.write_bytes(damages.of_bytes(file.read_bytes(), chance))

    def read(self, chance: Random) -> None:
        study = eft.Study.load(self.folder)
        for column in study.columns:
            assert len(study[column.name]) <= 6
        if study.complete:
            study.run(chance.randrange(6))
        if chance.random() < 0.02:
            command("report", self.folder, "-o", self.folder.with_suffix(".html"))
        elif chance.random() < 0.03:
            eft.study(RIG, COMMAND, GRID, output=self.folder, chunk=4, traces=True)


class Settings:
    """A test's TOML for `eft check`, or a calibration's for `eft run`."""

    LONGEST = 500_000
    """Samples of the longest test. A longer one rightly takes more memory than an attempt may."""
    SWEEP = '\n[command]\nkind = "sweep"\namplitude = 1000.0\nf_start = 0.5\nf_end = 4.0\nduration = 0.5\n'

    def __init__(self, folder: Path) -> None:
        self.plan, self.calibration, self.saved = (folder / name for name in ("t.toml", "c.toml", "t.eft"))
        self.rig = RIG.replace({"compensation.adaptive": True}).to_toml() + self.SWEEP
        self.plan.write_text(self.rig, "utf-8")
        command("run", self.plan, "-o", self.saved, "--save-calibration", self.calibration)
        self.sound = self.calibration.read_text("utf-8")
        self.of_plan = True

    def damage(self, chance: Random) -> None:
        self.of_plan = chance.random() < 0.6
        shaped = chance.random() < 0.3
        damage = damages.of_shape if shaped else damages.of_text
        plan = damage(self.rig, chance) if self.of_plan else self.rig
        # `tomllib` takes quadratic time for some shapes, which leave the duration as it is.
        too_long = not shaped and samples_of(plan) > self.LONGEST
        self.plan.write_text(self.rig if too_long else plan, "utf-8")
        self.calibration.write_text(damage(self.sound, chance), "utf-8")

    def read(self, chance: Random) -> None:
        if self.of_plan:
            command("check", self.plan)
        else:
            command("run", self.plan, "-o", self.saved, "--calibration", self.calibration)


class Door:
    """Messages to `eft.opensees.serve`: it drops the client with one line, and serves the next one."""

    SIZE = 256

    def __init__(self, folder: Path) -> None:
        self.visits: list[object] = []
        self.ended, started = threading.Semaphore(0), threading.Event()
        self.address, self.data = ("", 0), b""
        site = Site(RIG.replace({"structure.kind": "linear"}))

        def ready(*address: object) -> None:
            self.address = address
            started.set()

        def visited(visit: object) -> None:
            self.visits.append(visit)
            self.ended.release()

        options = {"port": 0, "clients": 10**9, "patience": 1.0, "idle": 2.0}
        serving = {"ready": ready, "visited": visited}
        threading.Thread(target=serve, args=(site,), kwargs=options | serving, daemon=True).start()
        assert started.wait(10.0)

    def message(self, action: float, displacement: float = 0.0) -> bytes:
        return struct.pack(f"<{self.SIZE}d", action, displacement, *[0.0] * (self.SIZE - 2))

    def sound(self) -> bytes:
        header = struct.pack("<11i", 1, 1, 1, 0, 1, 0, 0, 0, 1, 0, self.SIZE)
        moves = b"".join(self.message(3, move) + self.message(10) for move in (0.001, -0.002))
        return header + moves + self.message(5) + self.message(99)

    def damage(self, chance: Random) -> None:
        self.data = damages.of_bytes(self.sound(), chance)

    def read(self, chance: Random) -> None:
        visit = self.visit(self.data)
        assert visit.ending and "\n" not in visit.ending, visit
        if chance.random() < 0.2:
            again = self.visit(self.sound())
            assert again.ended_well and again.moves == 2, again
        if not visit.ended_well:
            raise ValueError(visit.ending)

    def visit(self, data: bytes) -> object:
        with socket.create_connection(self.address, timeout=10.0) as client, contextlib.suppress(OSError):
            client.sendall(data)
            client.shutdown(socket.SHUT_WR)
            while client.recv(65536):
                pass
        assert self.ended.acquire(timeout=30.0), "the server waits for a client that has gone"
        return self.visits.pop()


KINDS = {"run": Run, "traces": Traces, "study": Study, "settings": Settings, "door": Door}
