"""Wrong input to `eft run`, `init`, `iterate`, `serve` and `export`."""

from mistakes.given import (
    BEHIND_RIG,
    BUILDING,
    COMMAND,
    CORRECTED,
    CSV,
    DATA_SHEET,
    RECORD,
    SWEEP,
    as_test,
    paper,
)

WRONG = {
    "rig file in the place of a test": (
        ["run", "rig.toml", "--record", "elcentro"],
        {"rig.toml": paper()},
        ["rig.toml", "leave out --record", "--rig rig.toml"],
    ),
    "unknown command": (["rum"], {}, ["rum"]),
    "unknown option": (["run", "--swep"], {}, ["--swep"]),
    "word instead of a number": (["run", "--sweep", "1", "0", "ten", "1"], {}, ["ten", "--sweep"]),
    "too few numbers": (["run", "--sweep", "1", "0"], {}, ["--sweep"]),
    "no test": (["run"], {}, ["--sweep", "--record"]),
    "two commands": ([*SWEEP, "--record", "elcentro"], {}, ["exactly one"]),
    "file and options": (["run", "test.toml", "--scale", "2"], {}, ["--scale", "test.toml"]),
    "scale of a sweep": ([*SWEEP, "--scale", "2"], {}, ["command.scale"]),
    "unknown unit of the shipped record": (
        ["run", "--record", "elcentro", "--unit", "furlongs"],
        {},
        ["furlongs", "m/s2"],
    ),
    "setting without a value": ([*SWEEP, "--set", "structure.mass"], {}, ["structure.mass", "key=value"]),
    "unknown key": ([*SWEEP, "--set", "structure.mas=1"], {}, ["structure.mas", "`structure.mass`"]),
    "key out of range": ([*SWEEP, "--set", "structure.mass=-1"], {}, ["structure.mass", "-1", "kg"]),
    "key of a wrong type": ([*SWEEP, "--set", "structure.mass=heavy"], {}, ["heavy", "number"]),
    "unknown mode": ([*SWEEP, "--set", "compensation.mode=magic"], {}, ["magic", "nonlinear"]),
    "unknown precision": ([*SWEEP, "--dtype", "f16"], {}, ["f16", "f32"]),
    "rig to save without correction": (
        [
            *[*SWEEP, "--set", "compensation.adaptive=true", "--set", "compensation.curve_correction=false"],
            *["--save-rig", "next.toml"],
        ],
        {},
        ["next.toml", "compensation.curve_correction", "must be true"],
    ),
    "rig to save without estimators": (
        [*SWEEP, "--save-rig", "next.toml"],
        {},
        ["next.toml", "compensation.adaptive", "must be true"],
    ),
    "calibration of another version": (
        [*SWEEP, *CORRECTED, "--calibration", "old.toml"],
        {"old.toml": "[calibration]\nversion = 2\n"},
        ["old.toml, line 2", "calibration.version = 2", "must be 4: repeat the test"],
    ),
    "empty calibration": (
        [*SWEEP, *CORRECTED, "--calibration", "empty.toml"],
        {"empty.toml": "[calibration]\n"},
        ["empty.toml", "must have a section [calibration]"],
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
    "table of a building": (
        [*RECORD, "elcentro", *BUILDING, "-o", "run.csv"],
        {},
        ["run.csv", "must be .eft or .npz", "run.actuator(i)"],
    ),
    "sweep for a building": (
        [*SWEEP, *BUILDING],
        {},
        ["command.kind", "sweep", "one actuator", "record or drive"],
    ),
    "negative amplitude": (["run", "--sweep", "nan", "0", "10", "1"], {}, ["amplitude", "nan", "finite"]),
    "above half the rate": (["run", "--sweep", "1", "0", "4000", "1"], {}, ["f_end", "4000"]),
    "no duration": (["run", "--sweep", "1", "0", "10", "0"], {}, ["duration", "0"]),
    "too long to fit": (["run", "--sweep", "1", "0", "10", "1e9"], {}, ["4.096e12", "samples"]),
    "memory that is no number": ([*SWEEP, "--memory", "nan"], {}, ["--memory", "nan", "x>0"]),
    "sample rate of zero": ([*SWEEP, "--sample-rate", "0"], {}, ["sample_rate", "0"]),
    "no such record": ([*RECORD, "nowhere.at2"], {}, ["nowhere.at2", "No such file"]),
    "record that is plain text": ([*RECORD, "a.at2"], {"a.at2": "one\ntwo\nthree\nfour\nfive\n"}, ["a.at2"]),
    "record that declares a billion points": (
        [*RECORD, "a.at2"],
        {"a.at2": "PEER\nx\nACCELERATION IN UNITS OF G\nNPTS= 1000000000, DT= .01 SEC\n .1 .2 .3\n"},
        ["a.at2", "1000000000", "3"],
    ),
    "record without a unit": (
        [*RECORD, "a.csv"],
        {"a.csv": "time (s),acceleration\n0,1\n0.1,2\n"},
        ["a.csv", "`acceleration`", "--unit g", "m/s2"],
    ),
    "record of two bare columns": ([*RECORD, "a.txt"], {"a.txt": "0 1\n0.1 2\n"}, ["column 2", "--unit g"]),
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
    "infinite scale": ([*RECORD, "elcentro", "--scale", "inf"], {}, ["scale", "inf"]),
    "negative mass": ([*RECORD, "elcentro", "--mass", "-5"], {}, ["mass", "-5"]),
    "no such file": (["run", "nowhere.toml"], {}, ["nowhere.toml", "No such file"]),
    "a folder": (["run", "."], {}, ["folder"]),
    "not text": (["run", "test.toml"], {"test.toml": b"\xff\xfe\x00"}, ["test.toml", "UTF-8", "byte 1"]),
    "broken TOML": (["run", "test.toml"], as_test("a = [1,\n"), ["test.toml", "line 1, column"]),
    "nested too deeply": (["run", "test.toml"], as_test("a = " + "[" * 5000), ["test.toml"]),
    "no command": (["run", "test.toml"], as_test(paper(command="")), ["test.toml", "[command]"]),
    "command without a kind": (
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
    "text instead of a number": (
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
    "missing rig file": (["run", "test.toml"], as_test('rig = "a.toml"\n' + COMMAND), ["a.toml"]),
    "unknown suffix": ([*SWEEP, "-o", "out.xls"], {}, [".xls", ".csv"]),
    "no such folder": ([*SWEEP, "-o", "no/where/out.csv"], {}, ["no/where", "folder"]),
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
    "section without its key": (
        ["run", "test.toml"],
        as_test(paper(("mass = 7040.0\n", ""))),
        ["test.toml, line ", "missing key `structure.mass`", "`eft init` writes a complete file"],
    ),
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
    "sweep of 1e12 s": (
        ["run", "test.toml"],
        as_test(paper(command=COMMAND.replace("duration = 1.0", "duration = 1e12"))),
        ["number of samples = 4.096e15", "100000000"],
    ),
    "name that is not ASCII": (["run", "нет такого.toml"], {}, ["нет такого.toml", "No such file"]),
    "empty name": (["run", ""], {}, ["folder"]),
    "result without a name": ([*SWEEP, "-o", ""], {}, ["suffix"]),
    "setting without a key": ([*SWEEP, "--set", "=5"], {}, ["`=5`", "key=value"]),
    "file and sweep": (["run", "test.toml", *SWEEP[1:]], {}, ["test.toml", "--sweep"]),
    "record scaled beyond double precision": (
        [*RECORD, "elcentro", "--scale", "1e308"],
        {},
        ["scale = inf", "finite"],
    ),
    "binary record": ([*RECORD, "a.at2"], {"a.at2": b"\x00\x01" * 99}, ["a.at2", "zero bytes"]),
    "empty record": ([*RECORD, "a.csv"], {"a.csv": ""}, ["a.csv", "empty"]),
    "record that is a folder": ([*RECORD, "."], {}, ["irectory"]),
    "record sampled beyond the memory": (
        [*RECORD, "elcentro", "--sample-rate", "1e9"],
        {},
        ["number of samples", "100000000"],
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
    "watched analog loop": ([*SWEEP, "--watch"], {}, ["controller.realization", "digital"]),
    "rig into no folder": (["init", "no/rig.toml"], {}, ["no", "folder"]),
    "existing rig file": (["init"], {"rig.toml": ""}, ["rig.toml", "--force"]),
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
    "test and study at once": (["init", "a.toml", "--test", "--study"], {}, ["--test or --study"]),
    "drive of a test without its command": (
        ["iterate", "--sweep", "1", "0", "10", "1", "--measured", "a.csv"],
        {"a.csv": CSV},
        ["a.csv", "no signal command", "force"],
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
    "export without a target": (["export", "rig.toml"], {}, ["--target"]),
    "export to another language": (["export", "rig.toml", "--target", "ada"], {}, ["ada", "rust", "c"]),
    "part of a source to export": (
        ["export", "rig.toml", "--target", "c", "--part", "rig"],
        {"rig.toml": paper()},
        ["--part rig: only with --target fmu"],
    ),
    "version of FMI of a source to export": (
        ["export", "rig.toml", "--target", "rust", "--fmi", "3"],
        {"rig.toml": paper()},
        ["--fmi 3: only with --target fmu"],
    ),
    "export of a missing file": (
        ["export", "nowhere.toml", "--target", "c"],
        {},
        ["nowhere.toml", "No such file"],
    ),
    "export of a computation delay": (
        ["export", "test.toml", "--target", "c"],
        as_test(paper(("computation_delay = 0", "computation_delay = 1"), command="")),
        ["compensation.computation_delay", "1", "must be 0 for firmware"],
    ),
    "address of another machine to serve at": (
        ["serve", "rig.toml", "--host", "192.0.2.1"],
        {"rig.toml": paper()},
        ["host = '192.0.2.1', port = 8090", "cannot listen there"],
    ),
    "export of an empty file": (
        ["export", "test.toml", "--target", "rust"],
        as_test(""),
        ["test.toml", "missing key"],
    ),
}
