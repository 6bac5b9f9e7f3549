"""The detector: from phasors to evidence and verdicts."""
