"""The commands, a module each: ``new_rig`` holds ``sigdb new-rig`` as the function ``new_rig``."""
