"""Write ``docs/ledger.md``: every number printed in the three papers, with ours beside it.

    python -m tools.ledger

See the page's head for what it is made from.
"""

from retarget_bench.files import write_text
from tools.ledger import PAGE, written

if __name__ == "__main__":
    write_text(PAGE, written())
    print(PAGE)
