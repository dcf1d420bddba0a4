"""Runs the Python blocks of the pages with pictures, and copies the pictures that the blocks save.

A page shows ``_generated/NAME.png`` where one of its blocks saves ``NAME.png``, which a reader can repeat.
"""

import contextlib
import io
import os
import re
import shutil
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).parent
PICTURE = re.compile(r"\]\(((?:\.\./)?_generated/([\w-]+\.(?:png|svg)))\)")
BLOCK = re.compile(r"^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def draw(page: Path) -> None:
    """Run one page in a separate folder."""
    text = page.read_text(encoding="utf-8")
    wanted = PICTURE.findall(text)
    if not wanted:
        return
    here, names = Path.cwd(), {"__name__": "__main__"}
    with tempfile.TemporaryDirectory() as place:
        os.chdir(place)
        try:
            for block in BLOCK.findall(text):
                with contextlib.redirect_stdout(io.StringIO()):
                    exec(compile(block, str(page), "exec"), names)
        finally:
            os.chdir(here)
        for link, name in wanted:
            target = page.parent / link
            target.parent.mkdir(exist_ok=True)
            shutil.copyfile(Path(place) / name, target)


if __name__ == "__main__":
    pages = [Path(name) for name in sys.argv[1:]]
    for each in pages or sorted(
        [*HERE.glob("tutorial/*.md"), *HERE.glob("how-to/*.md"), *HERE.glob("reference/*/*.md")]
    ):
        draw(each)
