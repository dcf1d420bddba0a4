"""The browser of these tests."""

import pytest

import browsers


@pytest.fixture(scope="session")
def browser(tmp_path_factory):
    """A headless Chromium for all tests of this process."""
    with browsers.started(tmp_path_factory.mktemp("browser")) as browser:
        yield browser
