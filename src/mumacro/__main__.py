"""Run the command ``mumacro`` as ``python -m mumacro``."""

import sys

from mumacro.cli.main import main

if __name__ == "__main__":
    sys.exit(main())
