"""stub"""
from studies.core.table import Table
def tables(result):
    return [Table(result.base, file="base.csv", key="base"), Table(result.alone, file="alone.csv"), Table(result.reach, file="reach.csv"), Table(result.scores, file="hypotheses.csv", key="hypotheses"),
            Table(result.confusion, file="confusion.csv"), Table(result.indices, file="sobol.csv"), Table(result.checks, file="checks.csv"), Table(result.suspects, file="suspects.csv")]
def verdict(result): return "x"
def answer(result): return "x"
def figures(result): return ()
def facts(result): return {}
