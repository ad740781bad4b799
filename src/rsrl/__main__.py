"""`python -m rsrl`: the command `rsrl`, also where its script is not on the path."""

import sys

from rsrl.cli import main

if __name__ == "__main__":  # not when the documentation imports it
    sys.exit(main())
