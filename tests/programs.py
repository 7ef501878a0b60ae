"""Programs beside Python that some tests need: a browser, a virtual display, a renderer.

>>> browser = required("chromium", "/usr/bin/chromium")

They are Debian's, listed in `.ci/packages.txt`. Without one its tests are skipped, unless
FLEXSIM_ALL_TESTS is set, as in continuous integration: then they fail.
"""

from __future__ import annotations

import os
import shutil

import pytest

ALL = "FLEXSIM_ALL_TESTS"


def required(name: str, *others: str) -> str:
    """Return the path of a program, the first name that is one; else skip the test."""
    for each in (name, *others):
        found = shutil.which(each)
        if found:
            return found
    return missing(f"there is no program {name}")


def missing(what: str) -> str:
    """Skip the test for want of something, or fail it where all tests must run."""
    message = f"{what}; install the packages of .ci/packages.txt"
    if os.environ.get(ALL):
        pytest.fail(message)
    pytest.skip(message)
