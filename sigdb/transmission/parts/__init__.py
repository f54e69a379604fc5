"""Parts of a rig: shafts, bodies, gears, supports, sensors."""
