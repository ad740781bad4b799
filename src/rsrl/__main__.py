"""`python -m rsrl`: the command `rsrl`, also where its script is not on the path."""

import sys

from rsrl.cli import main

sys.exit(main())
