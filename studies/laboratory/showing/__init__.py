"""What the laboratory study found, in words, tables and figures."""
