"""Filters written for elsewhere: a C header, MATLAB, python-control, JSON.

>>> write(Path("circle.h"), exported)    # doctest: +SKIP
"""

from studies.tools.export.exported import Exported, of_controller, of_operator
from studies.tools.export.writing import FORMATS, check, format_of, write

__all__ = ["FORMATS", "Exported", "check", "format_of", "of_controller", "of_operator", "write"]
