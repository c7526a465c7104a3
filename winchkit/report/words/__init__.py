"""Numbers with units and uncertainty, the vocabulary, and sentences of verdicts."""
