"""`python -m groundray.cluster`: the command groundray-cluster."""

import sys

from groundray.cluster.command import main

sys.exit(main())
