"""`python -m hemline` is the `hemline` command."""

import sys

from hemline.cli import main

sys.exit(main())
