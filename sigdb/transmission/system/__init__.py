"""From parts to one modal system: beam elements, assembly, modes."""
