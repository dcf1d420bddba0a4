"""The page on hybrid simulation states the criteria of the sample controller."""

import re
from pathlib import Path

import numpy as np

import eft
from eft import rths

RECORD = Path(eft.__file__).parent / "data" / "RSN6_IMPVALL.I_I-ELC180-hor1.AT2"
PAGE = Path(__file__).resolve().parents[2] / "docs/reference/python/hybrid.md"


def test_the_sample_controller_lies_in_the_published_range_and_the_page_says_so():
    rows = re.findall(r"^\| (\d) \|(.+)\|$", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    assert [int(number) for number, _ in rows] == [1, 2, 3, 4]
    record = eft.read_record(RECORD)
    for building, (_, printed) in zip(rths.BUILDINGS, rows, strict=True):
        found = rths.simulate(record, building).criteria
        assert 0.09 <= found.j2 <= 0.105
        shown = [float(value) for value in printed.split("|")]
        np.testing.assert_allclose(shown[2:], [1e3 * found.j1, *(100.0 * np.array(found[1:]))], atol=0.06)
