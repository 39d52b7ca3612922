"""Soft Actor-Critic for saccades (thesis 2.4, 4.1, 4.6).

`config` what a run is, `sac` the algorithm, `replay_buffer` its memory, `network` its passes, `training` the run,
`loop` what happens between two updates, `checkpoint` how it goes on after an interruption, `evaluation` the result
against the searched optimum, `policy` the learned network as a file, `policy_export` the same for other programs,
`features` and `torch_policy` what its networks see, `figures` and `stages` its pictures and recording.
"""
