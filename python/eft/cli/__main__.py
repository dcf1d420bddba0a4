"""``python -m eft.cli``, where the script `eft` is not on the path."""

import sys

from _eft_script import main

sys.exit(main())
