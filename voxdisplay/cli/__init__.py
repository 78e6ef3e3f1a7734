"""The command line: arguments, printing, exit codes. No logic worth testing twice.

Results go to stdout, everything else to stderr.
"""

from voxdisplay.cli.main import main

__all__ = ["main"]
