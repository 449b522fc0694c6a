"""Golden runs: cases, their stored figures, and the comparison of two versions."""
