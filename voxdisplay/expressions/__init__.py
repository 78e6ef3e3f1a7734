"""Safe formulas: text to programs, their values, derivatives and enclosures. Knows no curves."""
