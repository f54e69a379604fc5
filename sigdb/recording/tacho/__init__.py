"""Tachos: pulses of a waveform, trains of pulses and their marks, encoders and speeds."""
