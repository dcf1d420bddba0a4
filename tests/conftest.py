"""Common fixtures."""

import gc
import re
import signal
from contextlib import contextmanager
from pathlib import Path

import pytest

# A shell starts what it runs in the background with Ctrl-C ignored, and children inherit that: tests of an
# interrupt would wait for what never comes.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# What the test modules import is never garbage. The collector would traverse it a hundred times: during the
# imports, and then for every test that needs a whole collection.
gc.disable()


def pytest_collection_finish():
    """Leave the imported modules out of every later collection of garbage."""
    gc.collect()
    gc.freeze()
    # Rarely: what the tests keep is little, and the collector would look for it at every figure.
    gc.set_threshold(20_000, 20, 100)
    gc.enable()


@pytest.fixture(scope="module")
def quick_pictures():
    """For a module whose tests read what is beside the pictures."""
    import pictures  # here, because the process that only distributes the tests needs no Matplotlib

    with pictures.quick():
        yield


@pytest.fixture
def peak_memory():
    """A context that fails where the process takes more than so many MiB beyond what it had."""

    def kilobytes(name):
        status = Path("/proc/self/status").read_text(encoding="ascii")
        return int(re.search(rf"^{name}:\s+(\d+)", status, re.MULTILINE)[1])

    @contextmanager
    def within(mebibytes):
        if not Path("/proc/self/clear_refs").exists():
            yield
            return
        gc.collect()
        Path("/proc/self/clear_refs").write_text("5", encoding="ascii")  # begin the peak anew
        before, files = kilobytes("VmRSS"), kilobytes("RssFile")
        yield
        # Pages of libraries that the system had dropped come back at any time.
        returned = max(kilobytes("RssFile") - files, 0)
        taken = (kilobytes("VmHWM") - before - returned) / 1024
        assert taken < mebibytes, f"{taken:.0f} MiB"

    return within
