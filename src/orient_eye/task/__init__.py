"""What is wanted of a saccade (thesis 4): actions, targets, the reward and its weights, the learning cases.

task = SaccadeTask.of_case(make_plant("mujoco"), "1")
task.actions, task.targets, task.weights
"""
