"""`python -m supple` is `supple`."""

import sys

from supple.app.cli.app import main

if __name__ == "__main__":
    sys.exit(main())
