"""``python -m eft`` is the command `eft`, for systems where its script is not on the path."""

import sys

from _eft_script import main

sys.exit(main())
