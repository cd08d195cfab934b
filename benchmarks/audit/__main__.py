"""`python benchmarks/audit`: the folders of the package and of the checkout are on the path before anything is imported."""

import importlib
import sys
from pathlib import Path

if __name__ == "__main__":
    benchmarks, checkout = Path(__file__).resolve().parents[1:3]
    sys.path[:0] = [str(benchmarks), str(checkout), str(checkout / "tests")]  # closed forms lie in tests/helpers
    sys.exit(importlib.import_module("audit.command").main())
