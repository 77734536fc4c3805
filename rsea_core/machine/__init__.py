"""What the owner states: rig, plant, inputs and load, spring table, kinematics."""
