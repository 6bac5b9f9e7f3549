"""openphase: size, prove and place open-phase detection on distribution feeders."""

__version__ = "0.1.0"
