"""What happens at t = 0. One small file per class; ``base`` holds what they share."""
