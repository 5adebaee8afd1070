"""`python -m covertool` is the covertool command."""

import sys

from covertool.cli.main import main

sys.exit(main())
