"""``python -m voxdisplay``: the command line."""

import sys

from voxdisplay.cli import main

if __name__ == "__main__":
    sys.exit(main())
