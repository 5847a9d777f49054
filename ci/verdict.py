"""How the checks end."""

import json
import sys

# A file that is wrong throughout says so often enough with these.
MOST_PROBLEMS = 20


def verdict(counts, problems):
    """Prints what was counted, and on standard error what is wrong; gives the exit status."""
    print(json.dumps(counts))
    for problem in problems[:MOST_PROBLEMS]:
        print(problem, file=sys.stderr)
    return 1 if problems else 0
