"""Soft Actor-Critic for saccades (thesis 2.4, 4.1, 4.6).

`config` what a run is, `sac` the algorithm, `replay_buffer` its memory, `training` the loop, `checkpoint`
how it goes on after an interruption, `evaluation` the result against the searched optimum, `policy` the
learned network as a file.
"""
