"""What the Python tools share: sessions, limits, the clairvoyant bound, simulator runs and their report."""
