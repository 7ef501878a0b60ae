"""One module per question: frozen configuration, pure run, thin command."""
