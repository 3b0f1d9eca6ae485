"""`python -m study`: the same as the command `hapteq`."""

import sys

from hapteq_launcher import main

if __name__ == "__main__":
    sys.exit(main())
