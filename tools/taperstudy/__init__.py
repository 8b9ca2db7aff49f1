"""What tools/study consists of."""
