"""``python -m mumacro`` is the command ``mumacro``."""

import sys

from mumacro.cli.main import main

if __name__ == "__main__":
    sys.exit(main())
