"""Drawing, Campbell diagram and text of a rig."""
