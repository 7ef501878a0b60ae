"""What every study shares: options, folder, tables, figures, how it is carried out."""
