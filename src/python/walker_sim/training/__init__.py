"""Training with Stable-Baselines3 on many walkers at once: ``python3 -m walker_sim train``.

Importing this package does not import Stable-Baselines3; `walker_sim.training.run` does.
"""
