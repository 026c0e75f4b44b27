"""Entry point of ``python3 -m walker_sim``."""

import sys

from walker_sim.commands import main

if __name__ == "__main__":
    sys.exit(main())
