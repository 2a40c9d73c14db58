"""The benchmark's own modules, which are no package, are put on the path before the tests here are collected."""

from __future__ import annotations

import sys

from tests.conftest import ROOT

sys.path.insert(0, str(ROOT / "benchmarks"))
