"""What happens at t = 0. One small file per class; ``base`` holds what they share.

Every draw function is pure: ``rng``, how many scenarios, the compiled network, where the
event may stand, then the laws of its class. Tie switching and transfer have no file: they
go from one network to another, with ``base.no_event`` in either.
"""
