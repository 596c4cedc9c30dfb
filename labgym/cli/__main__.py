"""`python -m labgym.cli`."""

import sys

from labgym.cli.app import main

sys.exit(main())
