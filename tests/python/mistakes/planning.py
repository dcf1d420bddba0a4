"""Wrong input to `eft check`, `map`, `study` and `demo`."""

from mistakes.given import BEHIND_RIG, CSV, RECORD, SWEEP, VALVE, as_test, paper, study

WRONG = {
    "record to check without a unit": (
        ["check", *RECORD[1:], "a.csv"],
        {"a.csv": "t,a\n0,1\n0.1,2\n"},
        ["`a`", "--unit g"],
    ),
    "empty file": (["check", "test.toml"], as_test(""), ["test.toml", "no section [command]"]),
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
    "rig files that go round": (
        ["map", "--rig", "test.toml"],
        as_test('rig = "test.toml"\n'),
        ["test.toml, line 1, column 1", "unknown key `rig`"],
    ),
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
    "record for the demo without a unit": (
        ["demo", "--record", "a.csv"],
        {"a.csv": "t,a\n0,1\n0.1,2\n"},
        ["`a`", "--unit g"],
    ),
    "demo scaled by nothing": (["demo", "--scale", "0"], {}, ["--scale 0", "other than zero"]),
    "demo without its record": (["demo", "--record", "nowhere.at2"], {}, ["nowhere.at2"]),
    "demo of a folder": (["demo", "--record", "."], {}, ["irectory"]),
}
