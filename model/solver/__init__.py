"""The compiled solver; ``model.solve`` is its door."""
