"""The node `page`."""

import sys

try:
    from walker_sim.web.over_ros import main
except ImportError as error:
    sys.exit(
        f"page: {sys.executable}, the first python3 on PATH, needs ROS and viser, pip install"
        f' "viser>=1.1,<2": {error}'
    )

main()
