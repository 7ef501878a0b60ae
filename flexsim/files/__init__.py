"""Files: those of others read with care, ours written whole or not at all, nothing left over."""
