"""Training with Stable-Baselines3 on many walkers at once: ``python3 -m walker_sim train``.

Importing this package imports nothing of the learner; `walker_sim.training.run` does.
"""
