"""Writes the generated parts of the evidence pages: the paper's numbers with the results, and the studies."""

import sys
from pathlib import Path

import benchmark
import check_against_run
import coverage
import curve_correction
import designed_plants
import fixed_against_adaptive
import force_loop
import laboratory_causes
import laboratory_rigs
import learning_cases
import learning_lasts
import null_bias
import paper_figures
import random_plants
import random_rigs
import safety_rig_tables
import safety_sound_tables
import safety_tables
import sized_rigs

from eft.demo.__main__ import main

FOLDER = Path(__file__).parent / "_generated"

if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    paper_figures.write(FOLDER)
    benchmark.report(FOLDER)
    check_against_run.report(FOLDER)
    laboratory_rigs.report(FOLDER)
    laboratory_causes.report(FOLDER)
    force_loop.report(FOLDER)
    learning_cases.report(FOLDER)
    learning_lasts.report(FOLDER)
    null_bias.report(FOLDER)
    coverage.report(FOLDER)
    curve_correction.report(FOLDER)
    designed_plants.report(FOLDER)
    random_plants.report(FOLDER)
    random_rigs.report(FOLDER)
    safety_rig_tables.report(FOLDER)
    safety_sound_tables.report(FOLDER)
    safety_tables.report(FOLDER)
    sized_rigs.report(FOLDER)
    fixed_against_adaptive.report(FOLDER)
    # A number that misses its reference ends the script, because the documentation must not show it as a
    # result.
    sys.exit(main(["--output", str(FOLDER)]))
