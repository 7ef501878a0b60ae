"""Parts put into other people's MJCF: a beam as a chain, the rest of the file left as it is."""
