"""From all runs to what can be said of them: scores, measures, verdicts, shares, linear loops."""
