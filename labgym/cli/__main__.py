"""`python -m labgym.cli`."""

import sys

from labgym.cli import main

sys.exit(main())
