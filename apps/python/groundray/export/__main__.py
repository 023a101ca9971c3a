"""`python -m groundray.export`: the command groundray-export."""

import sys

from groundray.export.command import main

sys.exit(main())
