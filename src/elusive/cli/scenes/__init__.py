"""What is made up to try a system on: `simulate_command` and `run_scene` of each, loaded when they are asked for."""
