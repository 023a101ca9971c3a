"""`python -m groundray.index`: the command groundray-index."""

import sys

from groundray.index.command import main

sys.exit(main())
