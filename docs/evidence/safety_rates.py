"""Faults of velocity and spool at other sample rates, on rigs of three sizes.

``python docs/evidence/safety_rates.py [MOMENTS]`` runs the tests of `safety_sizes` at other rates, with the
lost samples that the how-to advises. It writes ``data/safety_rates.csv``, from which
`safety_tables` makes a table of the page.
"""

import sys
from pathlib import Path

import safety
from safety_sizes import CASES, sizes

RESULTS = Path(__file__).parent / "data" / "safety_rates.csv"
MOMENTS = 24
LOST = {1024.0: 3, 2048.0: 10, 10000.0: 10}
"""Sample rates (Hz), and `protection.lost_samples` for each."""
FAULTS = tuple(case for case in CASES if case[0] in ("velocity", "spool"))


def main(moments: int) -> None:
    """Run everything."""
    rows = (
        {"rate": rate} | row
        for rate, lost in LOST.items()
        for row in sizes(moments, FAULTS, rate, {"protection.lost_samples": lost})
    )
    safety.write(RESULTS, rows)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else MOMENTS)
