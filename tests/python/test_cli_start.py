"""How the script `eft` starts: at once, and without a traceback when it is stopped."""

import os
import signal
import subprocess
import sys

import pytest

SCRIPT = "import sys, _eft_script; sys.exit(_eft_script.main())"


@pytest.mark.skipif(os.name != "posix", reason="interrupts are sent as signals")
def test_an_interrupt_while_the_package_loads_is_one_line(tmp_path):
    package = tmp_path / "eft"
    package.mkdir()
    (package / "__init__.py").write_text("import time\nprint('loading', flush=True)\ntime.sleep(60)\n")
    process = subprocess.Popen(
        [sys.executable, "-c", SCRIPT, "--help"],
        env=os.environ | {"PYTHONPATH": str(tmp_path)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    with process:
        assert process.stdout.readline() == "loading\n"
        process.send_signal(signal.SIGINT)
        assert process.communicate(timeout=30)[1] == "eft: interrupted\n"
    assert process.returncode == 130


def test_help_loads_neither_plots_nor_tables_nor_files_of_others():
    heavy = ("matplotlib", "scipy", "pandas", "pyarrow", "h5py", "distributed")
    program = (
        f"import sys, eft.cli; eft.cli.main(['--help']); print([m for m in {heavy} if m in sys.modules])"
    )
    answer = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert "eft init test.toml" in answer.stdout
    assert answer.stdout.splitlines()[-1] == "[]"
