"""``python3 -m talus`` does what the command ``talus`` does."""

import sys

from talus.command import main

sys.exit(main())
