"""``python -m eft.cli``, where the script `eft` is not on the path."""

import sys

from eft.cli import main

sys.exit(main())
