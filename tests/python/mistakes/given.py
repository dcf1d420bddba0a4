"""Files and options that several wrong inputs use."""

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


# Line of the first text after the rig
BEHIND_RIG = paper(command="").count("\n") + 1
