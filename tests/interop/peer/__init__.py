"""The parts of independent.py: another reading of docs/protocol.md. Nothing here comes from the firmware or tools/."""
