"""Wrong input to the command line, what files it needs, and what the answer must contain."""

import eft

DATA_SHEET = eft.data_sheets.TEMPLATE
CSV = "time (s),force (kN)\n0,1\n0.1,2\n0.2,1\n"
COMMAND = '[command]\nkind = "sweep"\namplitude = 1.0\nf_start = 0.0\nf_end = 10.0\nduration = 1.0\n'
VALVE = '[[valve]]\nname = "A"\nrated_flow = "10 gpm"\nrated_drop = "1000 psi"\nphase_90_frequency = 60\n'
SWEEP = ["run", "--sweep", "1", "0", "10", "1"]
RECORD = ["run", "--record"]
CORRECTED = ["--set", "compensation.adaptive=true", "--set", "compensation.curve_correction=true"]
BUILDING = [
    "--set",
    "structure.kind=shear_building",
    "--set",
    "structure.stories={masses=[7e3], dampings=[4e3], stiffnesses=[7e5]}",
]


def paper(replace=("", ""), command=COMMAND):
    text = eft.Rig.zhao2005().to_toml()
    assert replace[0] in text
    return text.replace(*replace) + command


def as_test(text):
    return {"test.toml": text}


def study(text):
    return as_test(paper() + text)


# the first line behind the rig's own
BEHIND_RIG = paper(command="").count("\n") + 1

# name: (arguments, files to put there first, what the line must contain)
WRONG = {
    # the command line itself
    "unknown command": (["rum"], {}, ["rum"]),
    "unknown option": (["run", "--swep"], {}, ["--swep"]),
    "no number": (["run", "--sweep", "1", "0", "ten", "1"], {}, ["ten", "--sweep"]),
    "too few numbers": (["run", "--sweep", "1", "0"], {}, ["--sweep"]),
    "nothing to run": (["run"], {}, ["--sweep", "--record"]),
    "two commands": ([*SWEEP, "--record", "elcentro"], {}, ["exactly one"]),
    "file and options": (["run", "test.toml", "--scale", "2"], {}, ["--scale", "test.toml"]),
    "scale of a sweep": ([*SWEEP, "--scale", "2"], {}, ["command.scale"]),
    "setting without a value": ([*SWEEP, "--set", "structure.mass"], {}, ["structure.mass", "key=value"]),
    "unknown key": ([*SWEEP, "--set", "structure.mas=1"], {}, ["structure.mas", "`structure.mass`"]),
    "key out of range": ([*SWEEP, "--set", "structure.mass=-1"], {}, ["structure.mass", "-1", "kg"]),
    "key of a wrong type": ([*SWEEP, "--set", "structure.mass=heavy"], {}, ["heavy", "number"]),
    "unknown mode": ([*SWEEP, "--set", "compensation.mode=magic"], {}, ["magic", "nonlinear"]),
    "unknown precision": ([*SWEEP, "--dtype", "f16"], {}, ["f16", "f32"]),
    "rig to save without correction": (
        [*SWEEP, "--set", "compensation.adaptive=true", "--save-rig", "next.toml"],
        {},
        ["next.toml", "compensation.curve_correction", "must be true"],
    ),
    "rig to save without estimators": (
        [*SWEEP, "--set", "compensation.curve_correction=true", "--save-rig", "next.toml"],
        {},
        ["next.toml", "compensation.adaptive", "must be true"],
    ),
    "rig to save over the test": (
        ["run", "test.toml", *CORRECTED, "--save-rig", "./test.toml"],
        {"test.toml": paper()},
        ["test.toml", "another file"],
    ),
    "rig to save in no folder": (
        [*SWEEP, *CORRECTED, "--save-rig", "nowhere/next.toml"],
        {},
        ["nowhere", "folder"],
    ),
    "rig to save of a building": (
        [*RECORD, "elcentro", *CORRECTED, *BUILDING, "--save-rig", "next.toml"],
        {},
        ["next.toml", "each floor finds its own", "run.actuator(i)"],
    ),
    # commands that cannot be
    "negative amplitude": (["run", "--sweep", "nan", "0", "10", "1"], {}, ["amplitude", "nan", "finite"]),
    "above half the rate": (["run", "--sweep", "1", "0", "4000", "1"], {}, ["f_end", "4000"]),
    "no duration": (["run", "--sweep", "1", "0", "10", "0"], {}, ["duration", "0"]),
    "too long to fit": (["run", "--sweep", "1", "0", "10", "1e9"], {}, ["4.096e12", "samples"]),
    "sample rate of zero": ([*SWEEP, "--sample-rate", "0"], {}, ["sample_rate", "0"]),
    "no such record": ([*RECORD, "nowhere.at2"], {}, ["nowhere.at2", "No such file"]),
    "record of words": ([*RECORD, "a.at2"], {"a.at2": "one\ntwo\nthree\nfour\nfive\n"}, ["a.at2"]),
    "record of a billion points": (
        [*RECORD, "a.at2"],
        {"a.at2": "PEER\nx\nACCELERATION IN UNITS OF G\nNPTS= 1000000000, DT= .01 SEC\n .1 .2 .3\n"},
        ["a.at2", "1000000000", "3"],
    ),
    "record without numbers": ([*RECORD, "a.csv"], {"a.csv": ""}, ["a.csv"]),
    "record without a unit": (
        [*RECORD, "a.csv"],
        {"a.csv": "time (s),acceleration\n0,1\n0.1,2\n"},
        ["a.csv", "`acceleration`", "--unit g", "m/s2"],
    ),
    "record of two bare columns": ([*RECORD, "a.txt"], {"a.txt": "0 1\n0.1 2\n"}, ["column 2", "--unit g"]),
    "record to check without a unit": (
        ["check", *RECORD[1:], "a.csv"],
        {"a.csv": "t,a\n0,1\n0.1,2\n"},
        ["`a`", "--unit g"],
    ),
    "record for the demo without a unit": (
        ["demo", "--record", "a.csv"],
        {"a.csv": "t,a\n0,1\n0.1,2\n"},
        ["`a`", "--unit g"],
    ),
    "record in a test file without a unit": (
        ["run", "test.toml"],
        as_test(paper(command='[command]\nkind = "record"\nfile = "a.csv"\n'))
        | {"a.csv": "t,a\n0,1\n0.1,2\n"},
        ["a.csv", "`a`", "unit"],
    ),
    "record of an unknown unit": (
        [*RECORD, "a.csv", "--unit", "furlong"],
        {"a.csv": "t,a\n0,1\n0.1,2\n"},
        ["unit", "furlong", "cm/s2"],
    ),
    "record of another unit than the file's": (
        [*RECORD, "a.csv", "--unit", "g"],
        {"a.csv": "t,a (m/s2)\n0,1\n0.1,2\n"},
        ["a.csv", "m/s2", "given is g"],
    ),
    "record without a step": ([*RECORD, "a.csv", "--unit", "g"], {"a.csv": "1\n2\n"}, ["a.csv", "dt"]),
    "unit of a sweep": ([*SWEEP, "--unit", "g"], {}, ["command.unit"]),
    "scale that is none": ([*RECORD, "elcentro", "--scale", "inf"], {}, ["scale", "inf"]),
    "negative mass": ([*RECORD, "elcentro", "--mass", "-5"], {}, ["mass", "-5"]),
    "export without a target": (["export", "rig.toml"], {}, ["--target"]),
    "export to another language": (["export", "rig.toml", "--target", "ada"], {}, ["ada", "rust", "c"]),
    "export of no rig": (["export", "nowhere.toml", "--target", "c"], {}, ["nowhere.toml", "No such file"]),
    "export of more than firmware has": (
        ["export", "test.toml", "--target", "c"],
        as_test(paper(("computation_delay = 0", "computation_delay = 1"), command="")),
        ["compensation.computation_delay", "1", "must be 0 for firmware"],
    ),
    # files
    "no such file": (["run", "nowhere.toml"], {}, ["nowhere.toml", "No such file"]),
    "a folder": (["run", "."], {}, ["folder"]),
    "not text": (["run", "test.toml"], {"test.toml": b"\xff\xfe\x00"}, ["test.toml", "UTF-8", "byte 1"]),
    "broken TOML": (["run", "test.toml"], as_test("a = [1,\n"), ["test.toml", "line 1, column"]),
    "nested too deeply": (["run", "test.toml"], as_test("a = " + "[" * 5000), ["test.toml"]),
    "no command": (["run", "test.toml"], as_test(paper(command="")), ["test.toml", "[command]"]),
    "command of no kind": (
        ["run", "test.toml"],
        as_test(paper(command="[command]\n")),
        ["kind", '"sweep"'],
    ),
    "key missing in command": (
        ["run", "test.toml"],
        as_test(paper(command=COMMAND.replace("f_end = 10.0\n", ""))),
        [f"test.toml, line {BEHIND_RIG}, column 1:", "command.f_end", "missing"],
    ),
    "key misspelt in command": (
        ["run", "test.toml"],
        as_test(paper(command=COMMAND.replace("f_end", "fend"))),
        ["`command.fend`", "`command.f_end`"],
    ),
    "word for a number": (
        ["run", "test.toml"],
        as_test(paper(command=COMMAND.replace("= 1.0", '= "1 kN"', 1))),
        ["command.amplitude", "1 kN", "number"],
    ),
    "rig key missing": (["run", "test.toml"], as_test(COMMAND), ["test.toml", "missing"]),
    "rig key misspelt": (
        ["run", "test.toml"],
        as_test(paper(("piston_area", "pistonarea"))),
        ["test.toml", "pistonarea", "piston_area"],
    ),
    "flow table not rising": (
        ["run", "test.toml"],
        as_test(paper(("[-1.0, -0.9,", "[-0.9, -1.0,"))),
        ["test.toml", "flow_table.openings"],
    ),
    "rig file and rig keys": (
        ["run", "test.toml"],
        as_test('rig = "a.toml"\nname = "x"\n' + COMMAND),
        ["test.toml", "name"],
    ),
    "rig file that is not there": (["run", "test.toml"], as_test('rig = "a.toml"\n' + COMMAND), ["a.toml"]),
    "rig files that go round": (
        ["map", "--rig", "test.toml"],
        as_test('rig = "test.toml"\n'),
        ["test.toml, line 1, column 1", "unknown key `rig`"],
    ),
    # outputs
    "unknown suffix": ([*SWEEP, "-o", "out.xls"], {}, [".xls", ".csv"]),
    "no such folder": ([*SWEEP, "-o", "no/where/out.csv"], {}, ["no/where", "folder"]),
    "rig into no folder": (["init", "no/rig.toml"], {}, ["no", "folder"]),
    "rig that is there": (["init"], {"rig.toml": ""}, ["rig.toml", "--force"]),
    # data of others
    "not a run": (
        ["compare", "a.eft", "a.eft"],
        {"a.eft": "words"},
        ["a.eft", "not a test saved by eft: no archive of arrays"],
    ),
    "only one": (["compare", "a.csv"], {"a.csv": CSV}, ["OTHER"]),
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
    "a cell too few": (
        ["compare", "a.csv", "a.csv"],
        {"a.csv": CSV.replace("0.1,2", "0.1")},
        ["line 3", "2"],
    ),
    "not a number": (
        ["compare", "a.csv", "a.csv"],
        {"a.csv": CSV.replace("0.1,2", "0.1,nan")},
        ["`force", "2"],
    ),
    "time that jumps": (
        ["compare", "a.csv", "a.csv"],
        {"a.csv": CSV.replace("0.2", "0.9")},
        ["evenly", "sample 3"],
    ),
    "time that runs back": (["compare", "a.csv", "a.csv"], {"a.csv": CSV.replace("0.2", "-1")}, ["increase"]),
    "no known column": (
        ["compare", "a.csv", "a.csv"],
        {"a.csv": CSV.replace("force (kN)", "mood")},
        ["mood"],
    ),
    "nothing in common": (
        ["compare", "a.csv", "b.csv"],
        {"a.csv": CSV, "b.csv": CSV.replace("force (kN)", "spool")},
        ["in common", "spool"],
    ),
    "not a MAT file": (["compare", "a.mat", "a.mat"], {"a.mat": "words " * 40}, ["a.mat", "MAT"]),
    "not an HDF5 file": (["compare", "a.h5", "a.h5"], {"a.h5": "words " * 40}, ["a.h5", "HDF5"]),
    "not a Parquet file": (["compare", "a.parquet", "a.parquet"], {"a.parquet": "words"}, ["Parquet"]),
    "column that is not there": (
        ["compare", "a.csv", "a.csv", "--column", "force=Load 3"],
        {"a.csv": CSV},
        ["Load 3", "force (kN)"],
    ),
    "quantity that is none": (
        ["compare", "a.csv", "a.csv", "--unit", "forse=kN"],
        {"a.csv": CSV},
        ["forse", "`force`"],
    ),
    # identification
    "delay of what is not there": (
        ["identify", "delay", "a.csv"],
        {"a.csv": CSV},
        ["a.csv", "no command", "force"],
    ),
    "delay of too little": (
        ["identify", "delay", "a.csv"],
        {
            "a.csv": CSV.replace("time (s)", "time (s),command (kN)")
            .replace(",1", ",1,1")
            .replace(",2", ",2,2")
        },
        ["eft identify"],
    ),
    "curve without an area": (["identify", "curve", "a.csv"], {"a.csv": CSV}, ["--piston-area", "--rig"]),
    # values in a file, which are pointed at
    "value out of range": (
        ["run", "test.toml"],
        as_test(paper(("mass = 7040.0", "mass = -7.0"))),
        ["test.toml, line ", "column 1:", "structure.mass = -7", "kg"],
    ),
    "value of a command": (
        ["run", "test.toml"],
        as_test('[command]\nkind = "sweep"\n  amplitude = "1 kN"\n' + paper(command="")),
        ["test.toml, line 3, column 3:", "command.amplitude = '1 kN'"],
    ),
    "value in a rig file": (
        ["run", "test.toml"],
        as_test('rig = "a.toml"\n' + COMMAND) | {"a.toml": paper(("mass = 7040.0", 'mass = "7 V"'), "")},
        ["a.toml, line ", "structure.mass", "7 V"],
    ),
    "data sheet with a gap": (
        ["init", "--from-data-sheet", "sheet.toml"],
        {"sheet.toml": '[supply]\npressure = "3000 psi"\n'},
        ["missing", "structure.mass", "servovalve.rated_flow"],
    ),
    "data sheet with a wrong unit": (
        ["init", "--from-data-sheet", "sheet.toml"],
        {"sheet.toml": DATA_SHEET.replace("250 kN", "250 kg")},
        ["sheet.toml, line ", "actuator.force", "250 kg", "N"],
    ),
    "data sheet with an unknown key": (
        ["init", "--from-data-sheet", "sheet.toml"],
        {"sheet.toml": DATA_SHEET.replace("rated_drop", "rate_drop")},
        ["unknown key `servovalve.rate_drop`", "rated_drop"],
    ),
    "frequency response without units": (
        ["identify", "valve", "bode.csv"],
        {"bode.csv": "frequency,amplitude,phase\n1,1,0\n"},
        ["bode.csv", "frequency (hz)"],
    ),
    "frequency response of an amplifier": (
        ["identify", "valve", "bode.csv"],
        {"bode.csv": "frequency (Hz),gain (dB),phase (deg)\n1,0,0\n10,0,10\n20,0,20\n30,0,30\n"},
        ["frequency response", "fall behind"],
    ),
    "section without its key": (
        ["run", "test.toml"],
        as_test(paper(("mass = 7040.0\n", ""))),
        ["test.toml, line ", "missing key `structure.mass`", "`eft init` writes a complete file"],
    ),
    # maps
    "map of nothing known": (["map", "--kind", "weather"], {}, ["weather", "level-damping"]),
    "map with one axis": (["map", "--x", "compensation.level", "0", "1", "3"], {}, ["--x and --y"]),
    "map over an unknown key": (
        ["map", "--x", "compensation.levle", "0", "1", "3", "--y", "structure.damping", "0", "1", "3"],
        {},
        ["compensation.levle", "`compensation.level`"],
    ),
    "map running back": (
        ["map", "--x", "compensation.level", "1", "0", "3", "--y", "structure.damping", "0", "1", "3"],
        {},
        ["--x compensation.level", "1 to 0", "below"],
    ),
    "map of a single point": (
        ["map", "--x", "compensation.level", "0", "1", "1", "--y", "structure.damping", "0", "1", "3"],
        {},
        ["1 points", "2 to 10000"],
    ),
    "map too fine": (
        ["map", "--x", "compensation.level", "0", "1", "9000", "--y", "structure.damping", "0", "1", "9000"],
        {},
        ["9000 × 9000", "250000"],
    ),
    "map as a film": (["map", "-o", "map.mp4"], {}, ["map.mp4", ".png", ".csv"]),
    "map of a broken rig": (["map", "--rig", "a.toml"], {"a.toml": "[structure]\n"}, ["a.toml", "missing"]),
    # studies
    "study that is not there": (["study", "nowhere.toml"], {}, ["nowhere.toml", "No such file"]),
    "study of nothing": (["study", "test.toml"], as_test(paper()), ["test.toml", "[study]"]),
    "study without a way": (
        ["study", "test.toml"],
        study("[study]\n"),
        ["none", "[study.grid]", "[study.sobol]"],
    ),
    "study both ways": (
        ["study", "test.toml"],
        study("[study.grid]\n[study.sobol]\n"),
        ["[study.grid] and [study.sobol]", "exactly one"],
    ),
    "study of a misspelt key": (
        ["study", "test.toml"],
        study('[study.grid]\n"structure.mas" = [1.0]\n'),
        ["test.toml, line ", "structure.mas", "`structure.mass`"],
    ),
    "study of no list": (
        ["study", "test.toml"],
        study("[study.grid]\nstructure.mass = 7.0\n"),
        [f"test.toml, line {BEHIND_RIG + 7}, column 1:", "structure.mass", "list of values"],
    ),
    "study of words for numbers": (
        ["study", "test.toml"],
        study('[study.grid]\nstructure.mass = [7040.0, "heavy"]\n'),
        ["test.toml, line ", "heavy", "number"],
    ),
    "range without a count": (
        ["study", "test.toml"],
        study("[study.grid]\nstructure.mass = { low = 1, high = 2 }\n"),
        ["test.toml, line ", "structure.mass.count", "whole number"],
    ),
    "range of a logarithm below zero": (
        ["study", "test.toml"],
        study("[study.grid]\nstructure.mass = { low = 0, high = 2, count = 3, log = true }\n"),
        ["structure.mass.low = 0", "above zero"],
    ),
    "sampler without a number": (
        ["study", "test.toml"],
        study("[study.sobol.ranges]\nstructure.mass = { low = 1, high = 2 }\n"),
        ["study.sobol", "n"],
    ),
    "sobol of no power of two": (
        ["study", "test.toml"],
        study("[study.sobol]\nn = 100\n[study.sobol.ranges]\nstructure.mass = { low = 1, high = 2 }\n"),
        ["n = 100", "power of two", "64 or 128"],
    ),
    "range that runs back": (
        ["study", "test.toml"],
        study("[study.latin_hypercube]\nn = 9\nranges.structure.mass = { low = 2, high = 1 }\n"),
        ["structure.mass", "low must lie below high"],
    ),
    "unknown option of a study": (
        ["study", "test.toml"],
        study("[study]\ntracse = true\n[study.grid]\nstructure.mass = [1.0]\n"),
        ["study.tracse", "traces"],
    ),
    "command and commands": (
        ["study", "test.toml"],
        study("[commands.a]\nkind = 'sweep'\n[study.grid]\nstructure.mass = [1.0]\n"),
        ["[command] and [commands]"],
    ),
    "study into another's folder": (
        ["study", "test.toml", "-o", "."],
        study("[study.grid]\nstructure.mass = [7040.0]\n"),
        ["other files"],
    ),
    "study into a file": (
        ["study", "test.toml", "-o", "a.csv"],
        study("[study.grid]\nstructure.mass = [7040.0]\n") | {"a.csv": CSV},
        ["a.csv", "folder"],
    ),
    "table as a picture": (
        ["study", "test.toml", "--table", "rows.png"],
        study("[study.grid]\nstructure.mass = [7040.0]\n"),
        ["rows.png", ".csv"],
    ),
    "scheduler that is not there": (
        ["study", "test.toml", "--dask", "mail://nowhere"],
        study("[study.grid]\nstructure.mass = [7040.0]\n"),
        ["--dask mail://nowhere"],
    ),
    # the report
    "report of nothing": (["report"], {}, ["RUNS"]),
    "report of no run": (
        ["report", "a.eft"],
        {"a.eft": "words"},
        ["a.eft", "not a test saved by eft: no archive of arrays"],
    ),
    "report of a folder": (["report", ".", "-o", "a.html"], {"a.csv": CSV}, ["not a study"]),
    "report as a picture": (["report", "a.eft", "-o", "a.png"], {"a.eft": "words"}, ["a.png", ".html"]),
    # the demonstration
    "demo scaled by nothing": (["demo", "--scale", "0"], {}, ["--scale 0", "other than zero"]),
    "demo without its record": (["demo", "--record", "nowhere.at2"], {}, ["nowhere.at2"]),
    # further mistakes
    "empty file": (["check", "test.toml"], as_test(""), ["test.toml", "no section [command]"]),
    "number beyond double precision": (
        ["run", "test.toml"],
        as_test(paper(command=COMMAND.replace("1.0", "1e400", 1))),
        ["test.toml, line ", "command.amplitude = inf", "finite"],
    ),
    "whole number beyond 64 bits": (
        ["run", "test.toml"],
        as_test(paper(("mass = 7040.0", "mass = " + "9" * 30))),
        ["test.toml", "line ", "64 bits"],
    ),
    "test of thirty thousand years": (
        ["run", "test.toml"],
        as_test(paper(command=COMMAND.replace("duration = 1.0", "duration = 1e12"))),
        ["number of samples = 4.096e15", "100000000"],
    ),
    "name that is not ASCII": (["run", "нет такого.toml"], {}, ["нет такого.toml", "No such file"]),
    "no name": (["run", ""], {}, ["folder"]),
    "result without a name": ([*SWEEP, "-o", ""], {}, ["suffix"]),
    "setting without a key": ([*SWEEP, "--set", "=5"], {}, ["`=5`", "key=value"]),
    "file and sweep": (["run", "test.toml", *SWEEP[1:]], {}, ["test.toml", "--sweep"]),
    "record scaled beyond double precision": (
        [*RECORD, "elcentro", "--scale", "1e308"],
        {},
        ["scale = inf", "finite"],
    ),
    "record of bytes": ([*RECORD, "a.at2"], {"a.at2": b"\x00\x01" * 99}, ["a.at2", "zero bytes"]),
    "record of nothing": ([*RECORD, "a.csv"], {"a.csv": ""}, ["a.csv", "empty"]),
    "record that is a folder": ([*RECORD, "."], {}, ["irectory"]),
    "record sampled beyond the memory": (
        [*RECORD, "elcentro", "--sample-rate", "1e9"],
        {},
        ["number of samples", "100000000"],
    ),
    "unit that is a fruit": (
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
    "picture of a comparison as a film": (
        ["compare", "a.csv", "a.csv", "--plot", "a.mp4"],
        {"a.csv": CSV},
        ["a.mp4", ".png"],
    ),
    "picture in no folder": (
        ["compare", "a.csv", "a.csv", "--plot", "no/a.png"],
        {"a.csv": CSV},
        ["no", "folder"],
    ),
    "band of a comparison upside down": (
        ["compare", "a.csv", "a.csv", "--band", "5", "1"],
        {"a.csv": CSV},
        ["band", "(5, 1)"],
    ),
    "units of no system": (["compare", "a.csv", "a.csv", "--units", "cgs"], {"a.csv": CSV}, ["cgs", "us"]),
    "report of measurements alone": (["report", "a.csv"], {"a.csv": CSV}, ["a.csv", "run.eft"]),
    "rig of a sensor that is not there": (
        ["compare", "a.csv", "a.csv", "--rig", "nowhere.toml"],
        {"a.csv": CSV},
        ["nowhere.toml", "No such file"],
    ),
    "unit line that names no unit": (
        ["compare", "a.txt", "a.txt"],
        {"a.txt": "Time\tForce\ns\tstones\n0\t1\n0.1\t2\n"},
        ["a.txt", "Force", "stones", "kip"],
    ),
    "clock that stands still": (
        ["compare", "a.csv", "a.csv"],
        {"a.csv": "time (s),force (N)\n1,1\n1,2\n1,3\n"},
        ["a.csv", "time must increase"],
    ),
    "not a TDMS file": (["compare", "a.tdms", "a.tdms"], {"a.tdms": "words " * 40}, ["a.tdms", "TDMS"]),
    "half a TDMS file": (
        ["compare", "a.tdms", "a.tdms"],
        {"a.tdms": b"TDSm\x0e\0\0\0"},
        ["a.tdms", "channels"],
    ),
    "not a universal file": (["compare", "a.uff", "a.uff"], {"a.uff": "words " * 40}, ["a.uff", "58"]),
    "half a universal file": (
        ["compare", "a.unv", "a.unv"],
        {"a.unv": "    -1\n    58\nforce\n    -1\n"},
        ["a.unv", "universal file"],
    ),
    "K-NET record cut short": (
        [*RECORD, "a.NS"],
        {
            "a.NS": "Sampling Freq(Hz) 100Hz\nDuration Time(s)  9\n"
            "Scale Factor      7845(gal)/8223790\nMemo.             \n 1 2 3\n"
        },
        ["a.NS", "900", "3"],
    ),
    "K-NET record without a factor": (
        [*RECORD, "a.NS"],
        {
            "a.NS": "Sampling Freq(Hz) 100Hz\nDuration Time(s)  9\n"
            "Scale Factor      big\nMemo.             \n 1 2 3\n"
        },
        ["a.NS", "scale factor", "big"],
    ),
    "record of too many lines": ([*RECORD, "a.csv"], {"a.csv": "\n" * 750_001 + "1\n"}, ["a.csv", "750000"]),
    "one signal twice": (
        ["compare", "a.csv", "a.csv"],
        {"a.csv": "time (s),force (kN),force (N)\n0,1,1\n1,2,2\n2,3,3\n"},
        ["two columns hold force", "force=HEADER"],
    ),
    "time that stands": (
        ["compare", "a.csv", "a.csv"],
        {"a.csv": "time (s),force (kN)\n1,1\n1,2\n1,3\n"},
        ["must increase, and goes from 1 s to 1 s"],
    ),
    "bytes for numbers": (["compare", "a.csv", "a.csv"], {"a.csv": b"\x80\x81" * 99}, ["a.csv", "UTF-8"]),
    "no lines": (["compare", "a.csv", "a.csv"], {"a.csv": ""}, ["a.csv", "header"]),
    "half a run": (["report", "a.eft"], {"a.eft": b"PK\x03\x04half"}, ["a.eft", "not a test saved by eft"]),
    "band upside down": (
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
    "map of two rigs": (["map", "a.toml", "--rig", "a.toml"], {}, ["once"]),
    "map of a folder": (["map", "."], {}, ["folder"]),
    "map without an end": (
        ["map", "--x", "compensation.level", "0", "nan", "3", "--y", "structure.damping", "0", "1", "3"],
        {},
        ["--x compensation.level", "nan", "finite"],
    ),
    "map over a word": (
        ["map", "--x", "compensation.mode", "0", "1", "3", "--y", "structure.damping", "1", "2", "3"],
        {},
        ["compensation.mode = 0", "nonlinear"],
    ),
    "map over one key": (
        ["map", "--x", "compensation.level", "0", "1", "3", "--y", "compensation.level", "0", "1", "3"],
        {},
        ["compensation.level", "another key"],
    ),
    "export of an empty file": (
        ["export", "test.toml", "--target", "rust"],
        as_test(""),
        ["test.toml", "missing key"],
    ),
    "test and study at once": (["init", "a.toml", "--test", "--study"], {}, ["--test or --study"]),
    "one run twice": (["report", "a.eft", "a.eft"], {"a.eft": "words"}, ["a.eft is given twice"]),
    "demo of a folder": (["demo", "--record", "."], {}, ["irectory"]),
    # a catalogue of valves
    "catalogue without a valve": (
        ["check", *SWEEP[1:], "--valves", "valves.toml"],
        {"valves.toml": 'name = "A"\n'},
        ["valves.toml", "[[valve]]"],
    ),
    "valve without a name": (
        ["check", *SWEEP[1:], "--valves", "valves.toml"],
        {"valves.toml": VALVE.replace('name = "A"', "")},
        ["valves.toml", "valve 1", "name"],
    ),
    "valve that is there twice": (
        ["check", *SWEEP[1:], "--valves", "valves.toml"],
        {"valves.toml": VALVE + VALVE},
        ["valves.toml", "valve 2", "twice"],
    ),
    "valve without its flow": (
        ["check", *SWEEP[1:], "--valves", "valves.toml"],
        {"valves.toml": VALVE.replace('rated_flow = "10 gpm"', "")},
        ["valves.toml", "valve A", "missing rated_flow"],
    ),
    "valve with a flow in psi": (
        ["check", *SWEEP[1:], "--valves", "valves.toml"],
        {"valves.toml": VALVE.replace("10 gpm", "10 psi")},
        ["valves.toml", "valve A", "10 psi"],
    ),
    "valve with an unknown key": (
        ["check", *SWEEP[1:], "--valves", "valves.toml"],
        {"valves.toml": VALVE + "flow = 1.0\n"},
        ["valve A", "unknown key `flow`", "rated_flow"],
    ),
    "catalogue that is a folder": (["check", *SWEEP[1:], "--valves", "."], {}, ["must be a file"]),
    "remedies of a table": (
        ["check", *SWEEP[1:], "--valves", "valves.toml", "--try-remedies"],
        {"valves.toml": VALVE},
        ["--try-remedies"],
    ),
    # measured data
    "drive of a test without its command": (
        ["iterate", "--sweep", "1", "0", "10", "1", "--measured", "a.csv"],
        {"a.csv": CSV},
        ["a.csv", "no command", "force"],
    ),
    "drive of a test of another length": (
        ["iterate", "--sweep", "1", "0", "10", "1", "--measured", "a.csv"],
        {"a.csv": "time (s),command (kN),force (kN)\n0,1,1\n0.1,2,2\n0.2,1,1\n"},
        ["samples", "must fit the measured test of 3"],
    ),
    "measured test of several actuators": (
        ["iterate", "--record", "elcentro", *BUILDING, "--measured", "a.csv"],
        {"a.csv": CSV},
        ["one actuator", "eft.iterate"],
    ),
    "spool in volts of an unknown sensor": (
        ["compare", "a.csv", "a.csv"],
        {"a.csv": "time (s),spool (V)\n0,1\n0.1,2\n0.2,1\n"},
        ["a.csv", "--rig"],
    ),
    "watched analog loop": ([*SWEEP, "--watch"], {}, ["controller.realization", "digital"]),
}
