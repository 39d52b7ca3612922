"""Saccades as reinforcement-learning environments: one episode is one saccade is one step.

    gymnasium.make("OrientEye/Saccade-v0", plant="mujoco")                      # saccade_env.SaccadeEnv
    gymnasium.make_vec("OrientEye/Saccade-v0", 512, "vector_entry_point", plant="lpf")   # vector_env.SaccadeVectorEnv
    sb3_env.SaccadeVecEnv(512, "lpf")                                           # for Stable-Baselines3

All three are thin over `batch.SaccadeBatch`, which is thin over `SaccadeTask`.
"""
