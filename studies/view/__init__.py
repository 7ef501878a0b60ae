"""Look at any run of any study in the rerun viewer, alone or beside others."""
