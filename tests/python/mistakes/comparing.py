"""Wrong input to `eft compare`, `identify` and `report`."""

from mistakes.given import CSV

WRONG = {
    "not a run": (
        ["compare", "a.eft", "a.eft"],
        {"a.eft": "words"},
        ["a.eft", "not a test saved by eft: no archive of arrays"],
    ),
    "one test only": (["compare", "a.csv"], {"a.csv": CSV}, ["OTHER"]),
    "no header": (["compare", "a.csv", "a.csv"], {"a.csv": "0,1\n1,2\n2,3\n"}, ["a.csv", "line 1", "header"]),
    "no unit": (
        ["compare", "a.csv", "a.csv"],
        {"a.csv": CSV.replace(" (kN)", "")},
        ["a.csv", "`force`", "--unit force=", "kip"],
    ),
    "unknown unit": (["compare", "a.csv", "a.csv"], {"a.csv": CSV.replace("kN", "tons")}, ["tons", "kip"]),
    "word among numbers": (
        ["compare", "a.csv", "a.csv"],
        {"a.csv": CSV.replace("0.1,2", "0.1,two")},
        ["a.csv", "line 3", "column 2", "two"],
    ),
    "line with too few cells": (
        ["compare", "a.csv", "a.csv"],
        {"a.csv": CSV.replace("0.1,2", "0.1")},
        ["line 3", "2"],
    ),
    "not a number": (
        ["compare", "a.csv", "a.csv"],
        {"a.csv": CSV.replace("0.1,2", "0.1,nan")},
        ["`force", "2"],
    ),
    "time with unequal steps": (
        ["compare", "a.csv", "a.csv"],
        {"a.csv": CSV.replace("0.2", "0.9")},
        ["evenly", "sample 3"],
    ),
    "time that decreases": (["compare", "a.csv", "a.csv"], {"a.csv": CSV.replace("0.2", "-1")}, ["increase"]),
    "no known column": (
        ["compare", "a.csv", "a.csv"],
        {"a.csv": CSV.replace("force (kN)", "mood")},
        ["mood"],
    ),
    "no common signal": (
        ["compare", "a.csv", "b.csv"],
        {"a.csv": CSV, "b.csv": CSV.replace("force (kN)", "spool")},
        ["in common", "spool"],
    ),
    "not a MAT file": (["compare", "a.mat", "a.mat"], {"a.mat": "words " * 40}, ["a.mat", "MAT"]),
    "not an HDF5 file": (["compare", "a.h5", "a.h5"], {"a.h5": "words " * 40}, ["a.h5", "HDF5"]),
    "not a Parquet file": (["compare", "a.parquet", "a.parquet"], {"a.parquet": "words"}, ["Parquet"]),
    "missing column": (
        ["compare", "a.csv", "a.csv", "--column", "force=Load 3"],
        {"a.csv": CSV},
        ["Load 3", "force (kN)"],
    ),
    "unknown quantity": (
        ["compare", "a.csv", "a.csv", "--unit", "forse=kN"],
        {"a.csv": CSV},
        ["forse", "`force`"],
    ),
    "unknown word as a unit": (
        ["compare", "a.csv", "a.csv", "--unit", "force=banana"],
        {"a.csv": CSV.replace(" (kN)", "")},
        ["`banana`", "kip"],
    ),
    "one sample": (
        ["compare", "a.csv", "a.csv"],
        {"a.csv": "time (s),force (kN)\n0,1\n"},
        ["a.csv: 1 sample"],
    ),
    "two decimal marks": (
        ["compare", "a.csv", "a.csv"],
        {"a.csv": "time (s);force (kN)\n0;1,5\n1;2,5\n2;1.003,5\n"},
        ["a.csv, line 4", "decimal mark"],
    ),
    "a text in UTF-16": (["compare", "a.csv", "a.csv"], {"a.csv": CSV.encode("utf-16")}, ["a.csv", "UTF-16"]),
    "zero bytes in a text": (
        ["compare", "a.csv", "a.csv"],
        {"a.csv": CSV.replace("0.1,2", "0.1,\0")},
        ["a.csv, line 3", "zero bytes"],
    ),
    "a preamble without names": (
        ["compare", "a.txt", "a.txt"],
        {"a.txt": "MTS793|MPT|ENU|1|0|.|/|:|1|0|0|A\nStation: a\nno columns\n"},
        ["a.txt", "column names"],
    ),
    "spool in volts without a rig": (
        ["compare", "a.csv", "a.csv"],
        {"a.csv": "time (s),spool (V)\n0,1\n0.1,2\n0.2,1\n"},
        ["a.csv", "spool (V)", "--rig", "servovalve.spool_sensitivity"],
    ),
    "aligned without a correlation": (
        ["compare", "a.csv", "b.csv", "--align"],
        {"a.csv": CSV, "b.csv": "time (s),force (kN)\n0,0\n0.1,0\n0.2,0\n"},
        ["align", "force", "b.csv"],
    ),
    "picture of a comparison with the suffix of a film": (
        ["compare", "a.csv", "a.csv", "--plot", "a.mp4"],
        {"a.csv": CSV},
        ["a.mp4", ".png"],
    ),
    "picture in no folder": (
        ["compare", "a.csv", "a.csv", "--plot", "no/a.png"],
        {"a.csv": CSV},
        ["no", "folder"],
    ),
    "band of a comparison with its ends exchanged": (
        ["compare", "a.csv", "a.csv", "--band", "5", "1"],
        {"a.csv": CSV},
        ["band", "(5, 1)"],
    ),
    "units of no system": (["compare", "a.csv", "a.csv", "--units", "cgs"], {"a.csv": CSV}, ["cgs", "us"]),
    "missing rig file of a sensor": (
        ["compare", "a.csv", "a.csv", "--rig", "nowhere.toml"],
        {"a.csv": CSV},
        ["nowhere.toml", "No such file"],
    ),
    "unknown unit in the line of units": (
        ["compare", "a.txt", "a.txt"],
        {"a.txt": "Time\tForce\ns\tstones\n0\t1\n0.1\t2\n"},
        ["a.txt", "Force", "stones", "kip"],
    ),
    "time that does not increase": (
        ["compare", "a.csv", "a.csv"],
        {"a.csv": "time (s),force (N)\n1,1\n1,2\n1,3\n"},
        ["a.csv", "time must increase"],
    ),
    "not a TDMS file": (["compare", "a.tdms", "a.tdms"], {"a.tdms": "words " * 40}, ["a.tdms", "TDMS"]),
    "truncated TDMS file": (
        ["compare", "a.tdms", "a.tdms"],
        {"a.tdms": b"TDSm\x0e\0\0\0"},
        ["a.tdms", "channels"],
    ),
    "not a universal file": (["compare", "a.uff", "a.uff"], {"a.uff": "words " * 40}, ["a.uff", "58"]),
    "truncated universal file": (
        ["compare", "a.unv", "a.unv"],
        {"a.unv": "    -1\n    58\nforce\n    -1\n"},
        ["a.unv", "universal file"],
    ),
    "two columns of one signal": (
        ["compare", "a.csv", "a.csv"],
        {"a.csv": "time (s),force (kN),force (N)\n0,1,1\n1,2,2\n2,3,3\n"},
        ["two columns have force", "force=HEADER"],
    ),
    "time that repeats": (
        ["compare", "a.csv", "a.csv"],
        {"a.csv": "time (s),force (kN)\n1,1\n1,2\n1,3\n"},
        ["must increase, and goes from 1 s to 1 s"],
    ),
    "bytes instead of numbers": (
        ["compare", "a.csv", "a.csv"],
        {"a.csv": b"\x80\x81" * 99},
        ["a.csv", "UTF-8"],
    ),
    "no lines": (["compare", "a.csv", "a.csv"], {"a.csv": ""}, ["a.csv", "header"]),
    "spool in volts of an unknown sensor": (
        ["compare", "a.csv", "a.csv"],
        {"a.csv": "time (s),spool (V)\n0,1\n0.1,2\n0.2,1\n"},
        ["a.csv", "--rig"],
    ),
    "delay of a missing signal": (
        ["identify", "delay", "a.csv"],
        {"a.csv": CSV},
        ["a.csv", "no signal command", "force"],
    ),
    "delay of too few samples": (
        ["identify", "delay", "a.csv"],
        {
            "a.csv": CSV.replace("time (s)", "time (s),command (kN)")
            .replace(",1", ",1,1")
            .replace(",2", ",2,2")
        },
        ["eft identify"],
    ),
    "curve without an area": (["identify", "curve", "a.csv"], {"a.csv": CSV}, ["--piston-area", "--rig"]),
    "frequency response without units": (
        ["identify", "valve", "bode.csv"],
        {"bode.csv": "frequency,amplitude,phase\n1,1,0\n"},
        ["bode.csv", "frequency (hz)"],
    ),
    "frequency response without delay": (
        ["identify", "valve", "bode.csv"],
        {"bode.csv": "frequency (Hz),gain (dB),phase (deg)\n1,0,0\n10,0,10\n20,0,20\n30,0,30\n"},
        ["frequency response", "phase must decrease"],
    ),
    "band with its ends exchanged": (
        ["identify", "delay", "a.csv", "--band", "10", "0.25"],
        {
            "a.csv": "time (s),command (kN),force (kN)\n"
            + "".join(f"{i},{i % 3},{i % 2}\n" for i in range(99))
        },
        ["band = (10, 0.25)", "lower first"],
    ),
    "curve of a rig that is a folder": (
        ["identify", "curve", "a.csv", "--rig", "."],
        {"a.csv": CSV},
        ["folder"],
    ),
    "damping of a folder": (["identify", "damping", "."], {}, ["folder"]),
    "report without a run": (["report"], {}, ["RUNS"]),
    "report of a file that is not a run": (
        ["report", "a.eft"],
        {"a.eft": "words"},
        ["a.eft", "not a test saved by eft: no archive of arrays"],
    ),
    "report of a folder": (["report", ".", "-o", "a.html"], {"a.csv": CSV}, ["not a study"]),
    "report of the working folder": (["report", "."], {"a.csv": CSV}, ["not a study"]),
    "report of all folders": (["report", "/"], {}, ["/: is the root of all folders"]),
    "study of a folder": (["study", "."], {}, ["is a folder"]),
    "report with the suffix of a picture": (
        ["report", "a.eft", "-o", "a.png"],
        {"a.eft": "words"},
        ["a.png", ".html"],
    ),
    "report of measurements alone": (["report", "a.csv"], {"a.csv": CSV}, ["a.csv", "run.eft"]),
    "truncated run": (
        ["report", "a.eft"],
        {"a.eft": b"PK\x03\x04half"},
        ["a.eft", "not a test saved by eft"],
    ),
    "one run twice": (["report", "a.eft", "a.eft"], {"a.eft": "words"}, ["a.eft is given twice"]),
}
