"""Optional packages; the error for a missing one names the extra to install."""

import re
import sys
from collections.abc import Sequence
from importlib import metadata, util

DISTRIBUTION = "effective-force-testing"


def need(package: str, *preferred: str) -> None:
    """Raise `ModuleNotFoundError` unless a package is installed; the message names its extra."""
    if sys.modules.get(package) is None and util.find_spec(package) is None:
        raise ModuleNotFoundError(missing(package, preferred), name=package)


def missing(package: str, preferred: Sequence[str] = ()) -> str:
    """The message for a missing package, with a preferred extra that installs it, or the first."""
    of = re.compile(rf"{re.escape(package)}\b.*extra == ['\"](\w+)['\"]", re.IGNORECASE)
    extras = [found[1] for line in metadata.requires(DISTRIBUTION) or () if (found := of.match(line))]
    extra = next((name for name in (*preferred, package, "files", "cluster") if name in extras), None)
    install = f"'{DISTRIBUTION}[{extra}]'" if extra else package
    return f"needs the package {package}, which is not installed: pip install {install}"
