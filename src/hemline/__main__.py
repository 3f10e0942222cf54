"""`python -m hemline` is the `hemline` command."""

import sys

from .cli import main

sys.exit(main())
