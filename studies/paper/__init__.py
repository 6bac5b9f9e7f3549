"""The paper's results beside the model's."""
