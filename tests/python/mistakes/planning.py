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
    "two valves of one name": (
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
    "remedies with a table": (
        ["check", *SWEEP[1:], "--valves", "valves.toml", "--try-remedies"],
        {"valves.toml": VALVE},
        ["--try-remedies"],
    ),
    "rig file that names another rig file": (
        ["map", "--rig", "test.toml"],
        as_test('rig = "test.toml"\n'),
        ["test.toml, line 1, column 1", "unknown key `rig`"],
    ),
    "unknown kind of map": (["map", "--kind", "weather"], {}, ["weather", "level-damping"]),
    "map with one axis": (["map", "--x", "compensation.level", "0", "1", "3"], {}, ["--x and --y"]),
    "map over an unknown key": (
        ["map", "--x", "compensation.levle", "0", "1", "3", "--y", "structure.damping", "0", "1", "3"],
        {},
        ["compensation.levle", "`compensation.level`"],
    ),
    "map with its ends exchanged": (
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
    "map with the suffix of a film": (["map", "-o", "map.mp4"], {}, ["map.mp4", ".png", ".csv"]),
    "map of a broken rig": (["map", "--rig", "a.toml"], {"a.toml": "[structure]\n"}, ["a.toml", "missing"]),
    "map of two rigs": (["map", "a.toml", "--rig", "a.toml"], {}, ["once"]),
    "map of a folder": (["map", "."], {}, ["folder"]),
    "map up to NaN": (
        ["map", "--x", "compensation.level", "0", "nan", "3", "--y", "structure.damping", "0", "1", "3"],
        {},
        ["--x compensation.level", "nan", "finite"],
    ),
    "map over a key that takes a word": (
        ["map", "--x", "compensation.mode", "0", "1", "3", "--y", "structure.damping", "1", "2", "3"],
        {},
        ["compensation.mode = 0", "nonlinear"],
    ),
    "map over the same key twice": (
        ["map", "--x", "compensation.level", "0", "1", "3", "--y", "compensation.level", "0", "1", "3"],
        {},
        ["compensation.level", "another key"],
    ),
    "missing study file": (["study", "nowhere.toml"], {}, ["nowhere.toml", "No such file"]),
    "study without settings": (["study", "test.toml"], as_test(paper()), ["test.toml", "[study]"]),
    "study without a grid, list or sampler": (
        ["study", "test.toml"],
        study("[study]\n"),
        ["none", "[study.grid]", "[study.sobol]"],
    ),
    "study with two samplers": (
        ["study", "test.toml"],
        study("[study.grid]\n[study.sobol]\n"),
        ["[study.grid] and [study.sobol]", "exactly one"],
    ),
    "study of a misspelt key": (
        ["study", "test.toml"],
        study('[study.grid]\n"structure.mas" = [1.0]\n'),
        ["test.toml, line ", "structure.mas", "`structure.mass`"],
    ),
    "study with a number instead of a list": (
        ["study", "test.toml"],
        study("[study.grid]\nstructure.mass = 7.0\n"),
        [f"test.toml, line {BEHIND_RIG + 7}, column 1:", "structure.mass", "list of values"],
    ),
    "study with a word instead of a number": (
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
    "sampler without a number of points": (
        ["study", "test.toml"],
        study("[study.sobol.ranges]\nstructure.mass = { low = 1, high = 2 }\n"),
        ["study.sobol", "n"],
    ),
    "Sobol points that are not a power of two": (
        ["study", "test.toml"],
        study("[study.sobol]\nn = 100\n[study.sobol.ranges]\nstructure.mass = { low = 1, high = 2 }\n"),
        ["n = 100", "power of two", "64 or 128"],
    ),
    "range with its ends exchanged": (
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
    "study into a folder with other files": (
        ["study", "test.toml", "-o", "."],
        study("[study.grid]\nstructure.mass = [7040.0]\n"),
        ["other files"],
    ),
    "study into a file": (
        ["study", "test.toml", "-o", "a.csv"],
        study("[study.grid]\nstructure.mass = [7040.0]\n") | {"a.csv": CSV},
        ["a.csv", "folder"],
    ),
    "table with the suffix of a picture": (
        ["study", "test.toml", "--table", "rows.png"],
        study("[study.grid]\nstructure.mass = [7040.0]\n"),
        ["rows.png", ".csv"],
    ),
    "scheduler that does not answer": (
        ["study", "test.toml", "--dask", "mail://nowhere"],
        study("[study.grid]\nstructure.mass = [7040.0]\n"),
        ["--dask mail://nowhere"],
    ),
    "record for the demo without a unit": (
        ["demo", "--record", "a.csv"],
        {"a.csv": "t,a\n0,1\n0.1,2\n"},
        ["`a`", "--unit g"],
    ),
    "demo with a scale of zero": (["demo", "--scale", "0"], {}, ["--scale 0", "other than zero"]),
    "demo with a missing record": (["demo", "--record", "nowhere.at2"], {}, ["nowhere.at2"]),
    "demo of a folder": (["demo", "--record", "."], {}, ["irectory"]),
}
