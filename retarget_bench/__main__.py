"""``python -m retarget_bench`` is ``bench``."""

from retarget_bench.cli import main

if __name__ == "__main__":
    main()
