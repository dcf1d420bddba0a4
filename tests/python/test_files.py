"""Files that are written under another name and then renamed."""

import stat
import subprocess
import sys

import pytest

from eft._files import atomic_write, write_text


def test_a_failure_leaves_the_old_file_and_nothing_else(tmp_path):
    path = tmp_path / "report.md"
    write_text(path, "old")
    with pytest.raises(RuntimeError), atomic_write(path) as temporary:
        temporary.write_text("half")
        raise RuntimeError
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_missing_folder_is_told_by_the_name_that_was_given(tmp_path):
    path = tmp_path / "none" / "report.md"
    with pytest.raises(FileNotFoundError) as caught:
        write_text(path, "new")
    assert caught.value.filename == str(path)


def test_a_new_file_can_be_read_by_those_the_umask_lets_in(tmp_path):
    path = tmp_path / "report.md"
    write_text(path, "new")
    (tmp_path / "plain").touch()
    assert stat.S_IMODE(path.stat().st_mode) == stat.S_IMODE((tmp_path / "plain").stat().st_mode)
    assert path.read_text() == "new"


def test_a_kill_in_the_middle_of_writing_leaves_the_old_file(tmp_path):
    path = tmp_path / "run.csv"
    path.write_text("old")
    script = (
        "import sys, time\nfrom pathlib import Path\nfrom eft._files import atomic_write\n"
        "with atomic_write(Path(sys.argv[1])) as temporary:\n"
        "    temporary.write_text('half of the new')\n    print('written', flush=True)\n    time.sleep(60)\n"
    )
    process = subprocess.Popen([sys.executable, "-c", script, path], stdout=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "written\n"
    process.kill()
    process.communicate(timeout=30)
    assert path.read_text() == "old"
