"""Runs the tests of a script inside Blender."""

import sys
import traceback


def run_tests(names):
    """Calls every function whose name starts with test_ and ends Blender, with 1 if one failed."""
    failed = 0
    tests = {name: test for name, test in names.items() if name.startswith("test_")}
    for name, test in tests.items():
        try:
            test()
            print(f"ok      {name}")
        except Exception:
            failed += 1
            traceback.print_exc()
            print(f"FAILED  {name}")
    print(f"{len(tests) - failed} passed, {failed} failed")
    sys.exit(failed > 0)
